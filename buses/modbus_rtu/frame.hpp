// Modbus RTU frames: pure encoding and checking. (Modbus over serial line V1.02; the drives' manuals 6.2.)
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "buses/error.hpp"

namespace axisd::modbus_rtu {

enum class Function : std::uint8_t {
  read_holding_registers = 0x03,
  write_single_register = 0x06,
  write_multiple_registers = 0x10
};

/// A complete frame with its CRC.
class Frame {
 public:
  static constexpr std::size_t capacity = 256;
  Frame() {}  // not defaulted: the bytes that are not in use stay as they are
  explicit Frame(std::span<const std::uint8_t> bytes);
  Frame(const Frame& other) : Frame(other.bytes()) {}
  Frame& operator=(const Frame& other);
  ~Frame() = default;
  void append(std::uint8_t byte) { bytes_.at(size_++) = byte; }
  void append_word(std::uint16_t word);  ///< high byte first
  void append_crc();                     ///< low byte first
  [[nodiscard]] std::span<const std::uint8_t> bytes() const { return {bytes_.data(), size_}; }
  [[nodiscard]] std::size_t size() const { return size_; }
  bool operator==(const Frame& other) const;

 private:
  // Only what is in use is copied, and stands close to its size: most frames are short.
  std::size_t size_ = 0;
  std::array<std::uint8_t, capacity> bytes_;
};

std::uint16_t crc16(std::span<const std::uint8_t> bytes);
/// "01 03 00 20 00 04 45 C3"
std::string to_hex(std::span<const std::uint8_t> bytes);

/// One request, by meaning.
struct Request {
  std::uint8_t node = 0;
  Function function = Function::read_holding_registers;
  std::uint16_t address = 0;
  std::uint16_t count = 1;              ///< registers read; for writes the size of `values`
  std::vector<std::uint16_t> values{};  ///< written registers
};

/// Encodes; refuses node 0 (broadcast is never used) and 248..255 (reserved), other functions, counts of 0,
/// more than 125 read or 123 written registers and addresses that would wrap.
Result<Frame> encode(const Request& request);
/// Size of the normal reply to `request` in bytes.
std::size_t reply_size(const Request& request);

/// Of a frame that begins with `head` (at least 3 bytes) and answers some master: by its function and byte
/// count. 0: nobody can say.
std::size_t reply_size(std::span<const std::uint8_t> head);

/// What a reply turned out to be.
enum class ReplyKind : std::uint8_t {
  match,      ///< answers the request
  exception,  ///< `exception_code` is the drive's
  foreign,    ///< a sound frame that does not answer this request (other node, function, size or echo)
  corrupt,    ///< too short or wrong CRC
};
struct Reply {
  ReplyKind kind = ReplyKind::corrupt;
  std::uint8_t exception_code = 0;
};
/// Checks the whole reply against the request: node, function, byte count, and the complete echo of a write.
Reply decode(const Request& request, std::span<const std::uint8_t> reply);

/// The most registers that one read may ask for: what fits into 256 bytes. The drives' own limit is lower
/// (6.2.1).
inline constexpr std::size_t largest_read = 125;
/// The values in a sound reply to a read; of anything else nothing.
class Registers {
 public:
  explicit Registers(const Frame& reply);
  [[nodiscard]] std::span<const std::uint16_t> values() const { return {values_.data(), size_}; }

 private:
  std::size_t size_ = 0;
  std::array<std::uint16_t, largest_read> values_;
};

}  // namespace axisd::modbus_rtu
