// A serial port for libmodbus: opened exclusively, at exactly the speed and format asked for.
#pragma once

#include <modbus/modbus.h>

#include <cstdint>
#include <expected>
#include <memory>
#include <span>
#include <string>

#include "buses/error.hpp"
#include "buses/modbus_rtu/frame.hpp"
#include "buses/modbus_rtu/settings.hpp"

namespace axisd::modbus_rtu {

/// Opening, setting and closing a port may block in the driver of a sick adapter for so long (closing_wait).
/// No frame is under way then, and the other buses go on: no reason to kill the daemon.
inline constexpr Duration longest_port_call = std::chrono::seconds(30);

/// What libmodbus made of the bytes that came.
enum class Reception : std::uint8_t {
  frame,       ///< sound, and from the node asked
  filtered,    ///< the first byte names another node; libmodbus has not checked the CRC
  damaged,     ///< wrong CRC or impossible length
  incomplete,  ///< the timeout passed inside a frame; the bytes are lost
  failed,      ///< the port failed; `native_error` is errno
};
struct Received {
  Reception kind = Reception::failed;
  Frame bytes{};
  int native_error = 0;
};

/// One open serial port with its libmodbus context. Thread: the one that owns it.
///
/// The descriptor is opened and set up here and then lent to libmodbus (modbus_set_socket): modbus_connect
/// knows only some speeds and silently takes 9600 for the rest, touches the settings of a port before anyone
/// could see that it is in use, and fails on a pty with parity.
class SerialPort {
 public:
  /// Opens `path` with the speed and format of `line`. Errors: `bus_down`, naming the port, why, and what to
  /// do.
  static Result<SerialPort> open(const LineSettings& line, const std::string& path);
  SerialPort(SerialPort&& other) noexcept;
  SerialPort& operator=(SerialPort&&) = delete;
  ~SerialPort();

  /// Changes speed and format; only while the line is silent. 0, EINVAL (the adapter cannot do it: the port
  /// now has no settings to rely on) or the errno with which the port was lost.
  int set_serial(const SerialSettings& serial);

  [[nodiscard]] int descriptor() const { return descriptor_; }
  [[nodiscard]] const std::string& path() const { return path_; }

  /// Hands a complete frame (with CRC) to the port; returns before the bytes are out. 0 or errno.
  int send(const Frame& request);
  /// Lets libmodbus read one frame. `timeout` counts until the frame's last byte.
  Received receive(std::uint8_t node, Duration timeout);
  /// Nothing lies ready; false where the port cannot tell.
  [[nodiscard]] bool empty() const;
  /// Something lies ready, or comes before `limit` has passed; false also where the port fails.
  [[nodiscard]] bool comes_within(Duration limit) const;
  /// Reads what is there, at most `buffer`, without waiting. Error: errno (EIO once the port hung up).
  std::expected<std::size_t, int> read_available(std::span<std::uint8_t> buffer);

 private:
  SerialPort(int descriptor, std::string path) : descriptor_(descriptor), path_(std::move(path)) {}
  struct Free {
    void operator()(modbus_t* context) const { modbus_free(context); }
  };
  int descriptor_ = -1;
  std::string path_;
  std::unique_ptr<modbus_t, Free> context_;
};

}  // namespace axisd::modbus_rtu
