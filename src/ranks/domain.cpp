/// Owners, ghosts and messages; see the header.
#include "src/ranks/domain.hpp"

#include <algorithm>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {

void Domain::set_owners(std::vector<Rank> owners, std::span<const std::uint32_t> mobile) {
  owner_ = std::move(owners);
  mine_.clear();
  owned_.clear(ranks_);
  for (const std::uint32_t body : mobile) {
    if (!is_foreign(body)) mine_.push_back(body);
    if (owner_[body] != kEveryRank) owned_.add(owner_[body], body);
  }
  present_ = mine_;
  is_present_.resize(owner_.size());
  before_.resize(owner_.size());
  std::uint32_t count = 0;
  for (std::uint32_t body = 0; body < owner_.size(); ++body) {
    is_present_[body] = is_foreign(body) ? 0 : 1;
    before_[body] = count;
    if (count < mine_.size() && mine_[count] == body) ++count;
  }
  ghosts_.clear(ranks_);
  lent_.clear(ranks_);
  ++version_;
}

void Domain::set_ghosts(BodyLists lent) {
  for (std::size_t r = 0; r < ranks_; ++r) {
    for (const std::uint32_t body : ghosts_.of(r)) is_present_[body] = 0;
  }
  lent_ = std::move(lent);
  const std::span<Message> messages = start_messages();
  for (std::size_t r = 0; r < ranks_; ++r) append_items(&messages[r], std::as_const(lent_).of(r));
  const std::span<const Message> received = send();
  ghosts_.clear(ranks_);
  present_ = mine_;
  for (std::size_t r = 0; r < ranks_; ++r) {
    std::vector<std::uint32_t>& ghosts = ghosts_.of(r);
    ghosts.resize(received[r].size() / sizeof(std::uint32_t));
    if (!ghosts.empty()) std::memcpy(ghosts.data(), received[r].data(), received[r].size());
    for (const std::uint32_t body : ghosts) is_present_[body] = 1;
    const auto middle = static_cast<std::ptrdiff_t>(present_.size());
    present_.insert(present_.end(), ghosts.begin(), ghosts.end());
    std::inplace_merge(present_.begin(), present_.begin() + middle, present_.end());
  }
  ++version_;
}

std::span<Communicator::Message> Domain::start_messages() {
  for (Message& message : sent_) message.clear();
  return sent_;
}

std::span<const Communicator::Message> Domain::send() {
  sent_[rank_].clear();
  communicator_->exchange(sent_, received_);
  received_[rank_].clear();
  return received_;
}

std::span<const Communicator::Message> Domain::send_to_all(const Message& message) {
  for (Message& sent : sent_) sent = message;
  return send();
}

bool Domain::any(bool own) {
  return std::ranges::any_of(gather<std::uint8_t>(own ? 1 : 0),
                             [](std::uint8_t value) { return value != 0; });
}

}  // namespace JFPX_ABI
}  // namespace jfpx
