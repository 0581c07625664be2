#include "buses/frame_ring.hpp"

#include <algorithm>
#include <cassert>
#include <cstring>
#include <tuple>
#include <type_traits>

namespace axisd {

/// A TracedFrame, packed.
struct FrameRing::Header {
  TimePoint at;
  const char* why;
  std::uint32_t id;
  std::uint16_t size;  ///< of the bytes behind it
  std::uint8_t why_size;
  TracedFrame::Kind kind;
  TransactionClass transaction_class;
  std::uint8_t node;
  std::uint8_t length : 4;
  bool on_network : 1, extended : 1, remote : 1;

  [[nodiscard]] static Header of(const TracedFrame& frame) {
    return {.at = frame.at,
            .why = frame.why.data(),
            .id = frame.id,
            .size = static_cast<std::uint16_t>(frame.bytes.size()),
            .why_size = static_cast<std::uint8_t>(frame.why.size()),
            .kind = frame.kind,
            .transaction_class = frame.transaction_class,
            .node = frame.node,
            .length = static_cast<std::uint8_t>(frame.length & 0xFU),
            .on_network = frame.on_network,
            .extended = frame.extended,
            .remote = frame.remote};
  }
  [[nodiscard]] TracedFrame frame(std::span<const std::uint8_t> bytes) const {
    return {.at = at,
            .kind = kind,
            .transaction_class = transaction_class,
            .node = node,
            .on_network = on_network,
            .extended = extended,
            .remote = remote,
            .length = length,
            .id = id,
            .why = {why, why_size},
            .bytes = bytes};
  }
};

FrameRing::FrameRing(std::size_t capacity)
    : storage_(std::max(capacity, sizeof(Header) + std::tuple_size_v<decltype(bytes_)>)) {}

void FrameRing::write(std::size_t offset, const void* from, std::size_t size) {
  const auto first = std::min(size, storage_.size() - offset);
  std::memcpy(storage_.data() + offset, from, first);
  std::memcpy(storage_.data(), static_cast<const std::byte*>(from) + first, size - first);
}

void FrameRing::copy(std::size_t offset, void* to, std::size_t size) const {
  const auto first = std::min(size, storage_.size() - offset);
  std::memcpy(to, storage_.data() + offset, first);
  std::memcpy(static_cast<std::byte*>(to) + first, storage_.data(), size - first);
}

FrameRing::Header FrameRing::header_at(std::size_t offset) const {
  static_assert(std::is_trivially_copyable_v<Header>);
  Header header;
  copy(offset, &header, sizeof header);
  return header;
}

void FrameRing::drop_oldest() {
  const auto size = sizeof(Header) + header_at(tail_).size;
  tail_ = (tail_ + size) % storage_.size();
  used_ -= size;
  ++oldest_;
}

void FrameRing::push(const TracedFrame& frame) {
  assert(frame.bytes.size() <= bytes_.size());
  const auto header = Header::of(frame);
  const auto size = sizeof header + header.size;
  while (used_ + size > storage_.size()) drop_oldest();
  write(head_, &header, sizeof header);
  if (header.size > 0) write((head_ + sizeof header) % storage_.size(), frame.bytes.data(), header.size);
  head_ = (head_ + size) % storage_.size();
  used_ += size;
  ++next_;
}

bool FrameRing::read(Place& place, Read& to) const {
  to.lost = 0;
  if (place.sequence < oldest_) {
    to.lost = oldest_ - place.sequence;
    place = begin();
  }
  if (place.sequence >= next_) return false;
  const auto header = header_at(place.offset);
  copy((place.offset + sizeof header) % storage_.size(), bytes_.data(), header.size);
  to.frame = header.frame({bytes_.data(), header.size});
  to.sequence = place.sequence;
  place = {.sequence = place.sequence + 1,
           .offset = (place.offset + sizeof header + header.size) % storage_.size()};
  return true;
}

}  // namespace axisd
