/// Changes and queries of a set of pairs.
#include "src/world/bodies/ignored_pairs.hpp"

#include "src/world/bodies/body_view.hpp"

#include <algorithm>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

std::uint64_t key_of(const BodyPair& pair) { return BodyView::key_of(pair.a, pair.b); }

}  // namespace

void IgnoredPairs::assign(std::span<const BodyPair> pairs) {
  std::vector<std::uint64_t> keys;
  keys.reserve(pairs.size());
  for (const BodyPair& pair : pairs) keys.push_back(key_of(pair));
  std::ranges::sort(keys);
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  keys_ = std::move(keys);
}

void IgnoredPairs::insert(const BodyPair& pair) {
  const std::uint64_t key = key_of(pair);
  const auto at = std::ranges::lower_bound(keys_, key);
  if (at == keys_.end() || *at != key) keys_.insert(at, key);
}

void IgnoredPairs::erase(const BodyPair& pair) noexcept {
  const std::uint64_t key = key_of(pair);
  const auto at = std::ranges::lower_bound(keys_, key);
  if (at != keys_.end() && *at == key) keys_.erase(at);
}

void IgnoredPairs::erase_body(std::uint32_t body) noexcept {
  std::erase_if(keys_, [body](std::uint64_t key) {
    return key >> 32 == body || (key & 0xffffffffu) == body;
  });
}

bool IgnoredPairs::contains(const BodyPair& pair) const noexcept {
  return std::ranges::binary_search(keys_, key_of(pair));
}

}  // namespace JFPX_ABI
}  // namespace jfpx
