#include "buses/modbus_rtu/serial_port.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <pty.h>
#include <sys/ioctl.h>
#include <sys/resource.h>
#include <sys/select.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <vector>

#include "terminal.hpp"

namespace axisd::modbus_rtu {
namespace {

using test::speed_of;

using std::chrono::milliseconds;

/// A pty: the test holds the master's end.
struct Pty {
  Pty() {
    int slave = -1;
    std::array<char, 64> name{};
    if (openpty(&master, &slave, name.data(), nullptr, nullptr) != 0) throw std::runtime_error("openpty");
    path = name.data();
    termios raw{};
    tcgetattr(slave, &raw);
    cfmakeraw(&raw);
    tcsetattr(slave, TCSANOW, &raw);
    close(slave);
  }
  ~Pty() { hang_up(); }
  Pty(const Pty&) = delete;
  void hang_up() {
    if (master >= 0) close(master);
    master = -1;
  }
  void say(const std::vector<std::uint8_t>& bytes) const {
    ASSERT_EQ(::write(master, bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
  }
  int master = -1;
  std::string path;
};

LineSettings line(int baud = 115200, Parity parity = Parity::none, int stop_bits = 1) {
  return {.name = "line-a", .port = "", .baud = baud, .format = {.parity = parity, .stop_bits = stop_bits}};
}

Frame framed(const std::vector<std::uint8_t>& bytes) {
  Frame frame(bytes);
  frame.append_crc();
  return frame;
}

TEST(SerialPort, OpensEverySpeedAndFormat) {
  for (const int baud : {9600, 14400, 19200, 38400, 115200, 128000, 250000, 256000}) {
    for (const auto parity : {Parity::none, Parity::even, Parity::odd}) {
      for (const int stop_bits : {1, 2}) {
        const Pty pty;
        const auto port = SerialPort::open(line(baud, parity, stop_bits), pty.path);
        ASSERT_TRUE(port) << to_string(port.error());
        EXPECT_EQ(speed_of(port->descriptor()), baud);
      }
    }
  }
}

TEST(SerialPort, AnOpenPortCanBeChangedAndBack) {
  const Pty pty;
  auto port = SerialPort::open(line(), pty.path);
  ASSERT_TRUE(port);
  for (const int baud : {9600, 128000, 1200, 115200}) {
    for (const int stop_bits : {1, 2}) {
      const Format format{.parity = Parity::even, .stop_bits = stop_bits};
      EXPECT_EQ(port->set_serial({.baud = baud, .format = format}), 0);
      EXPECT_EQ(speed_of(port->descriptor()), baud);
      termios settings{};
      ASSERT_EQ(tcgetattr(port->descriptor(), &settings), 0);
      EXPECT_EQ((settings.c_cflag & CSTOPB) != 0, stop_bits == 2);
    }
  }
}

TEST(SerialPort, CanBeReopenedWithTheSameSettings) {
  const Pty pty;
  for (int round = 0; round < 3; ++round) {
    const auto port = SerialPort::open(line(9600, Parity::even), pty.path);
    ASSERT_TRUE(port) << to_string(port.error());
    EXPECT_EQ(fcntl(port->descriptor(), F_GETFD) & FD_CLOEXEC, FD_CLOEXEC);
  }
}

TEST(SerialPort, SecondOpenIsRefusedAndNamesTheHolder) {
  const Pty pty;
  const auto first = SerialPort::open(line(), pty.path);
  ASSERT_TRUE(first);
  const auto second = SerialPort::open(line(), pty.path);
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().reason, Reason::bus_down);
  EXPECT_EQ(second.error().where.bus, "line-a");
  EXPECT_NE(second.error().message.find(pty.path), std::string::npos) << second.error().message;
  EXPECT_NE(second.error().message.find("(pid " + std::to_string(getpid()) + ")"), std::string::npos)
      << second.error().message;
}

TEST(SerialPort, SecondProcessIsRefusedAndDoesNotDisturbTheFirst) {
  const Pty pty;
  const auto first = SerialPort::open(line(), pty.path);
  ASSERT_TRUE(first);
  EXPECT_EXIT(
      {
        const auto second = SerialPort::open(line(9600, Parity::none, 2), pty.path);
        std::exit(!second && second.error().reason == Reason::bus_down ? 0 : 1);
      },
      testing::ExitedWithCode(0), "");
  termios settings{};
  ASSERT_EQ(tcgetattr(first->descriptor(), &settings), 0);
  EXPECT_EQ(settings.c_cflag & CSTOPB, 0U);
}

TEST(SerialPort, ErrorsNameThePortAndWhatToDo) {
  const auto missing = SerialPort::open(line(), "/nowhere/ttyUSB7");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().reason, Reason::bus_down);
  EXPECT_EQ(missing.error().where.native_code, static_cast<std::uint32_t>(ENOENT));
  EXPECT_NE(missing.error().message.find("/nowhere/ttyUSB7"), std::string::npos);
  EXPECT_NE(missing.error().remedy.find("plug the adapter in"), std::string::npos);

  const auto no_tty = SerialPort::open(line(), "/dev/null");
  ASSERT_FALSE(no_tty);
  EXPECT_NE(no_tty.error().message.find("not a serial port"), std::string::npos) << no_tty.error().message;
}

TEST(SerialPort, RefusesDescriptorsThatLibmodbusCannotWaitFor) {
  rlimit limit{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &limit), 0);
  limit.rlim_cur = std::min<rlim_t>(limit.rlim_max, FD_SETSIZE + 64);
  if (limit.rlim_cur <= FD_SETSIZE)
    GTEST_SKIP() << "this user may open at most " << limit.rlim_max << " files";
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &limit), 0);
  const Pty pty;
  std::vector<int> filled;
  while (filled.empty() || filled.back() < FD_SETSIZE - 1)
    filled.push_back(::open("/dev/null", O_RDONLY | O_CLOEXEC));
  const auto port = SerialPort::open(line(), pty.path);
  for (const int descriptor : filled) close(descriptor);
  ASSERT_FALSE(port);
  EXPECT_NE(port.error().message.find("1023"), std::string::npos) << port.error().message;
}

TEST(SerialPort, SendsTheFrameAsItIs) {
  const Pty pty;
  auto port = SerialPort::open(line(), pty.path);
  ASSERT_TRUE(port);
  for (const std::uint16_t count : {1, 6, 123}) {
    const auto frame = encode({.node = 7,
                               .function = Function::write_multiple_registers,
                               .values = std::vector<std::uint16_t>(count, 0x1234)});
    ASSERT_EQ(port->send(*frame), 0);
    std::vector<std::uint8_t> seen(frame->size());
    std::size_t got = 0;
    while (got < seen.size()) {
      const auto part = ::read(pty.master, seen.data() + got, seen.size() - got);
      ASSERT_GT(part, 0);
      got += static_cast<std::size_t>(part);
    }
    EXPECT_EQ(to_hex(seen), to_hex(frame->bytes()));
  }
}

TEST(SerialPort, TellsWhatCame) {
  const Pty pty;
  auto port = SerialPort::open(line(), pty.path);
  ASSERT_TRUE(port);
  const auto receive = [&](const Frame& frame, Duration timeout = std::chrono::seconds(10)) {
    pty.say({frame.bytes().begin(), frame.bytes().end()});
    return port->receive(1, timeout);
  };
  const std::pair<Frame, Reception> cases[]{
      {framed({1, 3, 2, 0x12, 0x34}), Reception::frame},
      {framed({1, 0x83, 0x0C}), Reception::frame},
      {framed({1, 6, 0, 0x27, 0, 1}), Reception::frame},
      {framed({1, 0x10, 0, 0x20, 0, 6}), Reception::frame},
      {framed({2, 3, 4, 1, 2, 3, 4}), Reception::filtered},
      {Frame(std::vector<std::uint8_t>{1, 3, 2, 0, 0, 0, 0}), Reception::damaged},
  };
  for (const auto& [frame, kind] : cases) {
    const auto received = receive(frame);
    EXPECT_EQ(received.kind, kind) << to_hex(frame.bytes());
    EXPECT_EQ(to_hex(received.bytes.bytes()), to_hex(frame.bytes()));
  }
  EXPECT_EQ(receive(Frame(std::vector<std::uint8_t>{1, 3, 0xFF})).kind,
            Reception::damaged);  // longer than any frame
  EXPECT_EQ(receive(Frame(std::vector<std::uint8_t>{1, 3, 2}), milliseconds(1)).kind, Reception::incomplete);
}

TEST(SerialPort, AnEmptyPortDiffersFromALostOne) {
  Pty pty;
  auto port = SerialPort::open(line(), pty.path);
  ASSERT_TRUE(port);
  std::array<std::uint8_t, 16> buffer{};
  EXPECT_EQ(port->read_available(buffer), std::size_t{0});
  pty.hang_up();
  EXPECT_EQ(port->read_available(buffer), std::unexpected(EIO));
  EXPECT_EQ(port->receive(1, milliseconds(1)).kind, Reception::failed);
  EXPECT_EQ(port->send(*encode({.node = 1})), EIO);
}

}  // namespace
}  // namespace axisd::modbus_rtu
