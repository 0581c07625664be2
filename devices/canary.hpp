// The canary: a block in the drive's memory that is never as a power-up leaves it. Finding what was written
// there shows that the drive was not restarted (M6, M7).
#pragma once

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <span>
#include <utility>
#include <vector>

namespace axisd {

/// What the block may hold. Pure. Thread: core. `Block`: an array of numbers.
///
///   any -- written(), found() ------------> one
///   any -- may_hold(): no reply came -----> one more
///   any -- forget() ----------------------> nothing
///
/// What a power-up may leave is kept apart: the factory's block for ever, and the newest that were found or
/// saved.
template <typename Block>
class Canary {
 public:
  explicit Canary(const Block& factory) : power_up_{factory} {}

  /// Contents that it may hold, the oldest first; none: not known.
  [[nodiscard]] std::span<const Block> blocks() const { return expected_; }
  [[nodiscard]] bool is_known() const { return expected_.size() == 1; }
  /// It holds this one, as far as anything is known.
  [[nodiscard]] bool is(const Block& block) const { return is_known() && expected_.front() == block; }
  [[nodiscard]] bool is_expected(const Block& block) const { return has(expected_, block); }

  void written(const Block& block) { expected_ = {block}; }
  /// It was read, and is_expected().
  void found(const Block& block) { written(block); }
  /// It was to be written, and no reply came.
  void may_hold(const Block& block) { expected_.push_back(block); }
  /// By an earlier run of the daemon.
  void expect(std::vector<Block> blocks) { expected_ = std::move(blocks); }
  void forget() { expected_.clear(); }
  /// To find this one proves nothing any more.
  void distrust(const Block& block) { std::erase(expected_, block); }

  /// A power-up may leave this.
  void note_power_up(const Block& block) {
    constexpr std::size_t most = 8;
    if (block == power_up_.front()) return;
    std::erase(power_up_, block);
    power_up_.push_back(block);
    if (power_up_.size() > most) power_up_.erase(std::next(power_up_.begin()));
  }
  /// The factory's, then the newest last.
  [[nodiscard]] std::span<const Block> power_up_blocks() const { return power_up_; }
  [[nodiscard]] bool is_left_by_power_up(const Block& block) const { return has(power_up_, block); }
  /// A block like it that no power-up leaves: its time at `ramp` differs a little.
  [[nodiscard]] Block distinct(Block block, std::size_t ramp) const {
    constexpr int high = 2000, room = 16;  // more than there are blocks
    auto& time = block.at(ramp);
    const int step = time < high - room ? 1 : -1;
    while (is_left_by_power_up(block)) time = static_cast<typename Block::value_type>(time + step);
    return block;
  }

 private:
  static bool has(const std::vector<Block>& blocks, const Block& block) {
    return std::ranges::find(blocks, block) != blocks.end();
  }

  std::vector<Block> expected_;
  std::vector<Block> power_up_;
};

}  // namespace axisd
