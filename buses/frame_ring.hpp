#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "buses/traced_frame.hpp"

namespace axisd {

/// The newest frames of a bus, in memory that is allocated once: a frame takes its bytes and 32 more.
/// Copyable, so that another thread can look through a copy. Not thread-safe.
class FrameRing {
 public:
  /// Where a reader is. The first frame has the sequence 1.
  struct Place {
    std::uint64_t sequence = 1;  ///< of the frame to read next
    std::size_t offset = 0;      ///< of it in the ring, as long as it is still there
  };
  struct Read {
    std::uint64_t sequence = 0;
    std::uint64_t lost = 0;  ///< frames before it that the reader was too slow for
    TracedFrame frame;       ///< valid until the next read
  };

  /// `capacity` in bytes; at least that of one frame is taken.
  explicit FrameRing(std::size_t capacity);

  void push(const TracedFrame& frame);
  /// Behind the newest frame.
  [[nodiscard]] Place end() const { return {.sequence = next_, .offset = head_}; }
  /// At the oldest frame.
  [[nodiscard]] Place begin() const { return {.sequence = oldest_, .offset = tail_}; }
  /// Reads one frame and moves `place` behind it. False: there is none yet.
  bool read(Place& place, Read& to) const;
  [[nodiscard]] std::size_t size() const { return static_cast<std::size_t>(next_ - oldest_); }

 private:
  struct Header;
  void write(std::size_t offset, const void* from, std::size_t size);
  void copy(std::size_t offset, void* to, std::size_t size) const;
  [[nodiscard]] Header header_at(std::size_t offset) const;
  void drop_oldest();

  std::vector<std::byte> storage_;
  std::size_t head_ = 0, tail_ = 0, used_ = 0;
  std::uint64_t oldest_ = 1, next_ = 1;
  mutable std::array<std::uint8_t, 256> bytes_{};  ///< of the frame that was read last
};

}  // namespace axisd
