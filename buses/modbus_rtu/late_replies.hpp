#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <utility>

#include "buses/modbus_rtu/line.hpp"
#include "buses/modbus_rtu/node_table.hpp"

namespace axisd::modbus_rtu {

/// What a node may still say long after it was asked. An FC03 reply carries no register address, an exception
/// not even a length, and the echo of a write is that of any write of the same value: so none of them is
/// taken for an answer while an older one like it may come. Pure.
class LateReplies {
 public:
  /// So long after its time a reply may still come: gateways and drives that save to their EEPROM.
  static constexpr Duration latest = std::chrono::seconds(5);
  /// Longest read that every drive answers (manuals: exception 05 beyond). A longer one that is refused
  /// proves nothing.
  static constexpr std::uint16_t longest_read = 16;

  /// What became of `request`, which went out. Replies come in order: nothing older than that to a read can
  /// follow. But the echo of a write may be that of the same write before, which was late, and an exception
  /// that of any read before: its own may still come then.
  void note(const Request& request, const ExchangeResult& result, TimePoint now);

  /// Within the last minute a frame was heard right after this node had left a request unanswered: most
  /// likely it answers, and later than it is waited for.
  [[nodiscard]] bool answers_late(std::uint8_t node, TimePoint now) const;

  /// A late reply would be taken for the one to this read.
  [[nodiscard]] bool may_answer(const Request& read, TimePoint now) const;
  /// The echo of this write may be that of an earlier one.
  [[nodiscard]] bool may_echo(const Request& write, TimePoint now) const;
  /// A read that is to go out before `waiting`, as no late reply is as long as its own, which therefore
  /// proves that none is to come: of registers that the node has answered before, if there are any. nullopt:
  /// there is none before distinct_at().
  [[nodiscard]] std::optional<Request> distinct_read(const Request& waiting, TimePoint now) const;
  /// `now` or long ago: there is one.
  [[nodiscard]] TimePoint distinct_at(std::uint8_t node, TimePoint now) const;

 private:
  struct Block {
    std::uint16_t address = 0, count = 0;
  };
  using Write = std::pair<std::uint16_t, std::uint16_t>;  ///< register, value

  void expect(const Request& request, TimePoint now);
  [[nodiscard]] bool is_late(std::uint8_t node, std::uint16_t count, TimePoint now) const;
  [[nodiscard]] std::uint16_t longest(std::uint8_t node) const;
  [[nodiscard]] bool any_late(std::uint8_t node, TimePoint now) const;

  /// Lengths of reads that timed out, by node, and until when their replies may still come.
  std::map<std::uint8_t, std::map<std::uint16_t, TimePoint>> reads_;
  std::map<std::uint8_t, std::map<Write, TimePoint>> echoes_;
  NodeTable<Block> answered_;               ///< the longest read that each node has answered
  std::optional<std::uint8_t> unanswered_;  ///< the node of the last exchange, where it was in vain
  NodeTable<TimePoint> heard_late_;
};

}  // namespace axisd::modbus_rtu
