#include "tests/can/bench.hpp"

#include <gtest/gtest.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdio>

#include "buses/can/socketcan_frame.hpp"

namespace axisd::can::test {

using namespace std::chrono_literals;

void ip(const std::string& commands) {
  auto* pipe = ::popen("ip -batch -", "w");
  ASSERT_NE(pipe, nullptr);
  std::fprintf(pipe, "%s\n", commands.c_str());
  ASSERT_EQ(::pclose(pipe), 0) << commands;
}

Peer::Peer(const std::string& interface) : fd_(::socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK, CAN_RAW)) {
  EXPECT_GE(fd_, 0) << "no SocketCAN here: run this by tests/guest/run.sh";
  if (fd_ < 0) return;
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(::if_nametoindex(interface.c_str()));
  EXPECT_EQ(::bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0) << interface;
}

Peer::~Peer() { ::close(fd_); }

bool Peer::send(const Frame& frame) {
  const auto kernel = to_kernel(frame);
  return ::write(fd_, &kernel, sizeof(kernel)) == static_cast<ssize_t>(sizeof(kernel));
}

void Peer::report_error(canid_t classes, std::uint8_t controller_status) {
  can_frame frame{};
  frame.can_id = CAN_ERR_FLAG | classes;
  frame.len = CAN_ERR_DLC;
  frame.data[1] = controller_status;
  ASSERT_EQ(::write(fd_, &frame, sizeof(frame)), static_cast<ssize_t>(sizeof(frame)));
}

std::vector<std::string> Peer::received() {
  std::vector<std::string> texts;
  can_frame frame{};
  while (::read(fd_, &frame, sizeof(frame)) == static_cast<ssize_t>(sizeof(frame)))
    texts.push_back(to_string(from_kernel(frame)));
  return texts;
}

Bench::Bench(PortSettings settings) : port(io.get_executor(), clock, std::move(settings)) {}

void Bench::start() {
  port.start({.on_frame = [this](const ReceivedFrame& frame) { received.push_back(frame); },
              .on_state = [this](const PortState& state) { states.push_back(state.link); },
              .may_gather = [this] { return patient; }});
}

bool Bench::until(const std::function<bool()>& condition) {
  const auto deadline = clock.now() + 10s;
  bool holds = condition();
  for (; !holds && clock.now() < deadline; holds = condition()) io.run_one_for(100ms);
  io.restart();
  return holds;
}

void Bench::linger(std::chrono::milliseconds time) {
  io.run_for(time);
  io.restart();
}

}  // namespace axisd::can::test
