/// Contact resolver of particles: the two loops of the thesis (4.4.6) without rotation.
#pragma once

#include "src/thesis/indexed_priority_queue.hpp"
#include "src/thesis/particle_store.hpp"

namespace jfpx {
inline namespace JFPX_ABI {

/// Owns its buffers, which grow and never shrink.
class ParticleResolver {
 public:
  /// Adds its iterations to *report.
  void resolve(ParticleStore& particles, std::span<const ParticleContact> contacts,
               const ParticleSettings& settings, ParticleReport* report);

 private:
  void list_contacts_of(const ParticleStore& particles, std::span<const ParticleContact> contacts);
  template <class Key, class Correct>
  std::uint64_t relax(std::span<const ParticleContact> contacts, std::uint64_t limit, Real epsilon,
                      bool* exhausted, Key key, Correct correct);

  IndexedPriorityQueue queue_;
  std::vector<Real> keys_, distance_;
  /// Contacts of particle p: contacts_of_[first_[p]] to contacts_of_[first_[p + 1] - 1].
  std::vector<std::uint32_t> first_, contacts_of_, next_;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
