// A node on a CAN network that is no drive: some objects, expedited SDO alone. Shares no code with the
// library but the network that carries its frames.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "buses/can/network.hpp"

namespace axisd::test {

/// Objects by index << 8 | sub-index.
class ObjectNode {
 public:
  struct Entry {
    std::uint32_t value = 0;
    std::size_t size = 4;
    bool writable = false;
  };
  /// `network` and `clock` outlive it.
  ObjectNode(Clock& clock, can::Network& network, std::uint8_t id, std::map<std::uint32_t, Entry> dictionary)
      : objects(std::move(dictionary)), clock_(&clock), network_(&network), id_(id) {
    participant_ = network.join([this](const can::Frame& frame, TimePoint at, bool) { on_frame(frame, at); });
  }
  ~ObjectNode() { network_->leave(participant_); }
  ObjectNode(const ObjectNode&) = delete;

  std::map<std::uint32_t, Entry> objects;
  bool silent = false;
  bool size_indicated = true;
  Duration turnaround = std::chrono::milliseconds(1);
  int reads = 0, writes = 0;

  void send(std::uint32_t id, const std::vector<std::uint8_t>& bytes) {
    network_->transmit(participant_, can::make_frame(id, bytes));
  }

 private:
  static constexpr std::uint32_t missing = 0x06020000, read_only = 0x06010002, wrong_size = 0x06070010;

  void on_frame(const can::Frame& frame, TimePoint at) {
    if (silent || frame.id != 0x600U + id_ || frame.size != 8 || frame.data[0] == 0x80) return;
    const auto reply = answer(frame.data);
    reply_ = clock_->call_at(at + turnaround, [this, reply] { send(0x580U + id_, reply); });
  }
  std::vector<std::uint8_t> answer(const std::array<std::uint8_t, 8>& asked) {
    const auto index = static_cast<std::uint32_t>(asked[1] | asked[2] << 8);
    const auto object = objects.find(index << 8U | asked[3]);
    const bool write = (asked[0] & 0xE0U) == 0x20;
    (write ? writes : reads) += 1;
    if (object == objects.end()) return reply(0x80, asked, missing);
    auto& entry = object->second;
    if (!write) {
      const auto size_bits = static_cast<std::uint8_t>(0x03U | (4 - entry.size) << 2U);
      return reply(static_cast<std::uint8_t>(0x40U | (size_indicated ? size_bits : 0x02U)), asked,
                   entry.value);
    }
    if (!entry.writable) return reply(0x80, asked, read_only);
    if (4U - (asked[0] >> 2U & 3U) != entry.size) return reply(0x80, asked, wrong_size);
    entry.value = 0;
    for (std::size_t i = 0; i < entry.size; ++i) entry.value |= std::uint32_t{asked[4 + i]} << 8 * i;
    return reply(0x60, asked, 0);
  }
  static std::vector<std::uint8_t> reply(std::uint8_t command, const std::array<std::uint8_t, 8>& asked,
                                         std::uint32_t value) {
    std::vector<std::uint8_t> bytes{command, asked[1], asked[2], asked[3]};
    for (unsigned i = 0; i < 4; ++i) bytes.push_back(static_cast<std::uint8_t>(value >> 8 * i));
    return bytes;
  }

  Clock* clock_;
  can::Network* network_;
  std::uint8_t id_;
  can::Network::Id participant_ = 0;
  Clock::Timer reply_;
};

}  // namespace axisd::test
