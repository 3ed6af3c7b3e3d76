/// Parts particles that overlap and lets them bounce: the thesis' two loops (4.4.6) without arms.
#pragma once

#include "src/world/indexed_priority_queue.hpp"
#include "src/world/particle_store.hpp"

namespace jfpx {
inline namespace JFPX_ABI {

/// Owns its buffers, which only grow.
class ParticleResolver {
 public:
  /// Counts its work in *report.
  void resolve(ParticleStore& particles, std::span<const ParticleContact> contacts,
               const ParticleSettings& settings, ParticleReport* report);

 private:
  void list_contacts_of(const ParticleStore& particles, std::span<const ParticleContact> contacts);
  template <class Key, class Correct>
  std::uint64_t relax(std::span<const ParticleContact> contacts, std::uint64_t limit, Real epsilon,
                      bool* exhausted, Key key, Correct correct);

  IndexedPriorityQueue queue_;
  std::vector<Real> keys_, distance_;
  /// Contacts of particle p: entries first_[p] to first_[p + 1] of of_.
  std::vector<std::uint32_t> first_, of_, next_;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
