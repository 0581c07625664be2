#include "buses/modbus_rtu/serial_port.hpp"

#include <asm/termbits.h>  // termios2 and BOTHER; clashes with <termios.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/select.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <system_error>
#include <utility>

#include "buses/modbus_rtu/wakeup.hpp"

namespace axisd::modbus_rtu {
namespace {

std::string text_of(int native_error) { return std::system_category().message(native_error); }

std::unexpected<Error> port_error(const LineSettings& line, int native_error, std::string message,
                                  std::string remedy) {
  Error error{.reason = Reason::bus_down, .message = std::move(message), .remedy = std::move(remedy)};
  error.where.bus = line.name;
  error.where.native_code = static_cast<std::uint32_t>(native_error);
  return fail(std::move(error));
}

/// "axisd (pid 123)": a process with the port open, as far as this user may see. `ours` is not counted.
std::optional<std::string> find_holder(dev_t device, int ours) {
  namespace fs = std::filesystem;
  std::error_code ignored;
  for (const auto& process : fs::directory_iterator("/proc", ignored)) {
    const auto pid = process.path().filename().string();
    if (!std::ranges::all_of(pid, [](char c) { return c >= '0' && c <= '9'; })) continue;
    const bool self = pid == std::to_string(getpid());
    std::error_code denied;
    for (fs::directory_iterator entry(process.path() / "fd", denied), end; !denied && entry != end;
         entry.increment(denied)) {
      struct stat status{};
      if (self && entry->path().filename() == std::to_string(ours)) continue;
      if (stat(entry->path().c_str(), &status) != 0 || status.st_rdev != device) continue;
      std::string name;
      std::ifstream(process.path() / "comm") >> name;
      return fmt::format("{} (pid {})", name, pid);
    }
  }
  return std::nullopt;
}

std::unexpected<Error> in_use(const LineSettings& line, const std::string& path, int native_error, int ours) {
  struct stat status{};
  const auto holder = stat(path.c_str(), &status) == 0 ? find_holder(status.st_rdev, ours) : std::nullopt;
  return port_error(line, native_error,
                    fmt::format("port {} is in use by {}", path, holder.value_or("another process")),
                    "stop that process or correct `port:`; one port serves one bus of one daemon");
}

std::unexpected<Error> cannot_open(const LineSettings& line, const std::string& path, int native_error) {
  const auto remedy = [&]() -> std::string {
    switch (native_error) {
      case ENOENT:
      case ENXIO:
      case ENODEV:
        return "plug the adapter in or correct `port:` (ls /dev/serial/by-id); it is tried again by itself";
      case EACCES:
      case EPERM:
        return "give the daemon's user access to the port (group dialout)";
      default:
        return "check the adapter and `port:`; it is tried again by itself";
    }
  }();
  return port_error(line, native_error,
                    fmt::format("port {} cannot be opened: {}", path, text_of(native_error)), remedy);
}

/// A pty has neither parity nor character size: it reads back 8N whatever was set.
bool is_pty(int descriptor) {
  constexpr unsigned first_major = 136;  // UNIX98 pty slaves (kernel: Documentation/admin-guide/devices.txt)
  constexpr unsigned last_major = 143;
  struct stat status{};
  if (fstat(descriptor, &status) != 0) return false;
  return major(status.st_rdev) >= first_major && major(status.st_rdev) <= last_major;
}

unsigned format_flags(const Format& format) {
  unsigned flags = CS8;
  if (format.parity != Parity::none) flags |= PARENB;
  if (format.parity == Parity::odd) flags |= PARODD;
  if (format.stop_bits == 2) flags |= CSTOPB;
  return flags;
}

termios2 raw_settings(const SerialSettings& serial) {
  termios2 settings{};
  settings.c_cflag = BOTHER | CREAD | CLOCAL | format_flags(serial.format);
  if (serial.format.parity != Parity::none) settings.c_iflag = INPCK;
  // With a minimum of 1 an empty port reads as EAGAIN and a lost one as 0, so that the two differ.
  settings.c_cc[VMIN] = 1;
  settings.c_ispeed = settings.c_ospeed = static_cast<speed_t>(serial.baud);
  return settings;
}

/// Adapters round to what their clock divides to; UARTs tolerate about 2 % between sender and receiver.
bool close_enough(speed_t actual, int asked) {
  return std::abs(static_cast<long>(actual) - asked) * 50L <= asked;
}

struct Applied {
  int native_error = 0;
  speed_t speed = 0;  ///< what the adapter made of it
  bool right_speed = false, right_format = false;
  [[nodiscard]] bool as_asked() const { return native_error == 0 && right_speed && right_format; }
};

/// Sets the port and reads back what became of it.
Applied apply(const SerialSettings& serial, int descriptor) {
  const auto settings = raw_settings(serial);
  termios2 actual{};
  if (ioctl(descriptor, TCSETS2, &settings) != 0 || ioctl(descriptor, TCGETS2, &actual) != 0)
    return {.native_error = errno};
  const unsigned checked = is_pty(descriptor) ? CSTOPB : CSIZE | PARENB | PARODD | CSTOPB;
  ioctl(descriptor, TCFLSH, TCIOFLUSH);  // bytes from before are nobody's reply
  return {
      .speed = actual.c_ospeed,
      .right_speed = close_enough(actual.c_ospeed, serial.baud) && close_enough(actual.c_ispeed, serial.baud),
      .right_format = ((actual.c_cflag ^ settings.c_cflag) & checked) == 0};
}

Result<void> configure(const LineSettings& line, const std::string& path, int descriptor) {
  const auto applied = apply(line.serial(), descriptor);
  if (applied.native_error == ENOTTY)
    return port_error(line, ENOTTY, fmt::format("port {} is not a serial port", path), "correct `port:`");
  if (applied.native_error != 0) return cannot_open(line, path, applied.native_error);
  if (!applied.right_speed)
    return port_error(
        line, EINVAL,
        fmt::format("port {} cannot do {} bit/s (it offers {})", path, line.baud, applied.speed),
        "choose another `baud:` on drives and bus, or another adapter");
  if (!applied.right_format)
    return port_error(line, EINVAL, fmt::format("port {} cannot do this parity or number of stop bits", path),
                      "choose another `format:` on drives and bus, or another adapter");
  return {};
}

char parity_letter(Parity parity) {
  return parity == Parity::none ? 'N' : parity == Parity::even ? 'E' : 'O';
}

/// Length of the frame that libmodbus assembled in `bytes`: it tells only whether it was sound.
std::size_t assembled_length(std::span<const std::uint8_t> bytes) {
  constexpr std::size_t shortest = 5;  // what it takes of a function that it does not know
  return std::clamp(reply_size(bytes), shortest, bytes.size());
}

}  // namespace

Result<SerialPort> SerialPort::open(const LineSettings& line, const std::string& path) {
  const int descriptor = ::open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (descriptor < 0 && errno == EBUSY) return in_use(line, path, EBUSY, descriptor);
  if (descriptor < 0) return cannot_open(line, path, errno);
  SerialPort port(descriptor, path);
  // Neither lock alone is enough: TIOCEXCL does not hold root back, flock only those that ask.
  if (flock(descriptor, LOCK_EX | LOCK_NB) != 0) return in_use(line, path, errno, descriptor);
  if (descriptor >= FD_SETSIZE)  // libmodbus would overrun its fd_set, which aborts the process
    return port_error(
        line, EMFILE,
        fmt::format("port {} got descriptor {}, libmodbus can use 0 to {}", path, descriptor, FD_SETSIZE - 1),
        "lower the number of open files before the buses are opened");
  if (auto done = configure(line, path, descriptor); !done) return fail(std::move(done.error()));
  ioctl(descriptor, TIOCEXCL);
  port.context_.reset(
      modbus_new_rtu(path.c_str(), line.baud, parity_letter(line.format.parity), 8, line.format.stop_bits));
  if (!port.context_) return cannot_open(line, path, errno);
  modbus_set_socket(port.context_.get(), descriptor);
  // Recovery by libmodbus loops for ever on a lost adapter; the worker does its own.
  modbus_set_error_recovery(port.context_.get(), MODBUS_ERROR_RECOVERY_NONE);
  // Without a byte timeout the response timeout holds for the whole frame, dripping nodes included.
  modbus_set_byte_timeout(port.context_.get(), 0, 0);
  return port;
}

SerialPort::SerialPort(SerialPort&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)),
      path_(std::move(other.path_)),
      context_(std::move(other.context_)) {}

SerialPort::~SerialPort() {
  if (descriptor_ < 0) return;
  // Only the owner of the lock has set it; on a pty the mark would outlive this descriptor.
  if (context_) ioctl(descriptor_, TIOCNXCL);
  close(descriptor_);
}

int SerialPort::set_serial(const SerialSettings& serial) {
  const auto applied = apply(serial, descriptor_);
  return applied.as_asked() || applied.native_error != 0 ? applied.native_error : EINVAL;
}

int SerialPort::send(const Frame& request) {
  const auto bytes = request.bytes();
  const auto sent = write(descriptor_, bytes.data(), bytes.size());
  if (sent < 0) return errno;
  return std::cmp_equal(sent, bytes.size()) ? 0 : EIO;  // of a part, the rest of the frame is lost
}

Received SerialPort::receive(std::uint8_t node, Duration timeout) {
  using std::chrono::duration_cast;
  using std::chrono::microseconds;
  const auto total = std::max(duration_cast<microseconds>(timeout), microseconds(1)).count();
  modbus_set_response_timeout(context_.get(), static_cast<std::uint32_t>(total / 1'000'000),
                              static_cast<std::uint32_t>(total % 1'000'000));
  modbus_set_slave(context_.get(), node);
  std::array<std::uint8_t, MODBUS_RTU_MAX_ADU_LENGTH> buffer{};
  const int length = modbus_receive_confirmation(context_.get(), buffer.data());
  if (length > 0)
    return {.kind = Reception::frame, .bytes = Frame({buffer.data(), static_cast<std::size_t>(length)})};
  const Frame assembled({buffer.data(), assembled_length(buffer)});
  if (length == 0) return {.kind = Reception::filtered, .bytes = assembled};
  switch (errno) {
    case ETIMEDOUT:
      return {.kind = Reception::incomplete};
    case EMBBADCRC:
      return {.kind = Reception::damaged, .bytes = assembled};
    case EMBBADDATA:
      return {.kind = Reception::damaged, .bytes = Frame({buffer.data(), 3})};
    case ECONNRESET:
      return {.native_error = EIO};  // read returned 0: hung up
    default:
      return {.native_error = errno >= MODBUS_ENOBASE ? EIO : errno};
  }
}

bool SerialPort::empty() const {
  // Not FIONREAD: it does not count what the kernel is about to hand over.
  pollfd watched{.fd = descriptor_, .events = POLLIN, .revents = 0};
  return poll(&watched, 1, 0) == 0;
}

bool SerialPort::comes_within(Duration limit) const {
  const timespec timeout = to_timespec(limit);
  pollfd watched{.fd = descriptor_, .events = POLLIN, .revents = 0};
  return ppoll(&watched, 1, &timeout, nullptr) == 1 && (watched.revents & POLLIN) != 0;
}

std::expected<std::size_t, int> SerialPort::read_available(std::span<std::uint8_t> buffer) {
  const auto got = read(descriptor_, buffer.data(), buffer.size());
  if (got > 0) return static_cast<std::size_t>(got);
  if (got == 0) return std::unexpected(EIO);
  if (errno == EAGAIN || errno == EINTR) return std::size_t{0};
  return std::unexpected(errno);
}

}  // namespace axisd::modbus_rtu
