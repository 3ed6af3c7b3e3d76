/// Stages and items of a sweep; see the header.
#include "src/contact_solver/cpu/work_list.hpp"

#include <algorithm>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

/// Large parts of a color are divided, so that other threads may help a late one.
constexpr std::uint32_t kBlocksPerItem = 48;

}  // namespace

void WorkList::build(std::span<const BlockRange> ranges, std::uint32_t parts) {
  std::size_t most_items = 0;
  for (const BlockRange& range : ranges) most_items += range.size() / kBlocksPerItem + 1;
  items_.reserve(most_items, "work items of a solver");
  stages_.reserve(ranges.size(), "work items of a solver");
  item_count_ = stage_count_ = 0;
  BlockRange run{0, 0};  // of small colors
  const auto flush = [&] {
    if (run.size() == 0) return;
    add_item(run, 0);
    add_stage(item_count_ - 1);
    run = {0, 0};
  };
  for (std::size_t color = 0; color < ranges.size(); color += parts) {
    const std::span<const BlockRange> of_color = ranges.subspan(color, parts);
    BlockRange all{UINT32_MAX, 0};
    std::uint32_t size = 0;
    for (const BlockRange& range : of_color) {
      if (range.size() == 0) continue;
      all = {std::min(all.first, range.first), std::max(all.last, range.last)};
      size += range.size();
    }
    if (size == 0) continue;
    if (size <= kSmallColor) {
      if (run.size() > 0 && run.last != all.first) flush();
      run = {run.size() > 0 ? run.first : all.first, all.last};
      if (run.size() >= kSmallColor) flush();
      continue;
    }
    flush();
    const std::uint32_t first_item = item_count_;
    for (std::uint32_t part = 0; part < parts; ++part) {
      const BlockRange& range = of_color[part];
      for (std::uint32_t i = range.first; i < range.last; i += kBlocksPerItem) {
        add_item({i, std::min(range.last, i + kBlocksPerItem)}, part);
      }
    }
    add_stage(first_item);
  }
  flush();
  number_claims(parts);
}

void WorkList::add_item(const BlockRange& blocks, std::uint32_t part) {
  items_[item_count_++] = {blocks, part, 0};
}

void WorkList::add_stage(std::uint32_t first_item) {
  stages_[stage_count_++] = {first_item, item_count_};
}

void WorkList::number_claims(std::uint32_t parts) {
  next_claim_.reserve(parts, "work items of a solver");
  std::fill_n(next_claim_.data(), parts, 0u);
  for (std::uint32_t i = 0; i < item_count_; ++i) ++next_claim_[items_[i].part];
  claims_ = 0;
  for (std::uint32_t part = 0; part < parts; ++part) {
    const std::uint32_t count = next_claim_[part];
    next_claim_[part] = claims_;
    claims_ += (count + kClaimsPerLine - 1) / kClaimsPerLine * kClaimsPerLine;
  }
  for (std::uint32_t i = 0; i < item_count_; ++i) items_[i].claim = next_claim_[items_[i].part]++;
}

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
