#include "tests/can/slcan_adapter.hpp"

#include <gtest/gtest.h>
#include <linux/sockios.h>
#include <linux/tty.h>
#include <poll.h>
#include <pty.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <sstream>

#include "tests/can/bench.hpp"

namespace axisd::can::test {

SlcanAdapter::SlcanAdapter(std::uint32_t bitrate) {
  EXPECT_EQ(::openpty(&master_, &slave_, nullptr, nullptr, nullptr), 0);
  termios settings{};
  ::tcgetattr(slave_, &settings);
  ::cfmakeraw(&settings);
  ::tcsetattr(slave_, TCSANOW, &settings);
  const int discipline = N_SLCAN;
  EXPECT_EQ(::ioctl(slave_, TIOCSETD, &discipline), 0);
  std::array<char, 32> name{};
  EXPECT_EQ(::ioctl(slave_, SIOCGIFNAME, name.data()), 0);
  interface_ = name.data();
  // A thread of its own: setting the interface up waits until its commands were read.
  reader_ = std::thread([this] { read_on(); });
  ip("link set " + interface_ + " txqueuelen 10\nlink set " + interface_ + " type can restart-ms 0" +
     (bitrate == 0 ? "" : " bitrate " + std::to_string(bitrate)));
}

SlcanAdapter::~SlcanAdapter() {
  stalled_ = false;
  ip("link set " + interface_ + " down");
  ended_ = true;
  reader_.join();
  ::close(slave_);  // removes the interface
  ::close(master_);
}

void SlcanAdapter::say(const std::string& text) {
  EXPECT_EQ(::write(master_, text.data(), text.size()), static_cast<ssize_t>(text.size()));
}

void SlcanAdapter::read_on() {
  while (!ended_) {
    pollfd readable{.fd = master_, .events = POLLIN, .revents = 0};
    if (::poll(stalled_ ? nullptr : &readable, stalled_ ? 0 : 1, 5) != 1) continue;
    std::array<char, 4096> buffer;
    const auto length = ::read(master_, buffer.data(), buffer.size());
    const std::scoped_lock lock(mutex_);
    if (length > 0) text_.append(buffer.data(), static_cast<std::size_t>(length));
  }
}

std::string SlcanAdapter::taken() {
  const std::scoped_lock lock(mutex_);
  std::istringstream lines(std::exchange(text_, {}));
  std::string frames;
  for (std::string line; std::getline(lines, line, '\r');)
    if (line.starts_with('t')) frames += (frames.empty() ? "" : " ") + line.substr(0, 4);
  return frames;
}

}  // namespace axisd::can::test
