// What a page says on its lane, and what comes of it.
#pragma once

#include <gmock/gmock.h>

#include <string>
#include <utility>
#include <vector>

#include "api/web/gateway/big_endian.hpp"
#include "api/web/gateway/lane_state.hpp"
#include "axisd/v1/axis_service.pb.h"

namespace axisd::web {

using namespace std::chrono_literals;

/// A page with a link that takes no time, unless it says so, and what came of what it did.
class LaneTest : public testing::Test {
 protected:
  void note(const LaneEffects& effects) {
    for (const auto& effect : effects) {
      if (const auto* call = std::get_if<LaneCall>(&effect)) {
        log.push_back(std::string(name_of(call->method)));
        numbers.push_back(call->number);
        messages.push_back(call->message);
        patience.push_back(call->patience);
      } else if (const auto* bytes = std::get_if<LaneSend>(&effect)) {
        constexpr const char* kinds[] = {"?", "answer", "late", "echo", "refused"};
        log.emplace_back(kinds[static_cast<std::size_t>(bytes->bytes.front())]);
        if (log.back() == "echo") number = bytes->bytes.substr(bytes->bytes.size() - 8);
      } else {
        log.emplace_back("close");
      }
    }
  }
  void say(std::string_view method, const std::string& message, Duration late = {}) {
    std::string bytes(1, '\1');
    append_big_endian32(bytes, ++last_id);
    append_big_endian32(bytes, static_cast<std::uint32_t>((now - late).time_since_epoch() / 1ms));
    bytes += static_cast<char>(method.size());
    bytes += method;
    bytes += message;
    note(lane.receive(bytes, now));
  }
  void echo(Duration late = {}) { say("", "", late); }
  void return_number() { say("", number); }
  void SetUp() override {
    echo();
    return_number();
    (void)taken();
  }
  void jog(Duration hold = 300ms, Duration late = {}, const std::string& axis = "feeder") {
    v1::JogRequest request;
    request.set_axis(axis);
    request.set_velocity(1);
    request.mutable_options()->set_request_id(press);
    request.mutable_hold()->set_nanos(static_cast<std::int32_t>(hold.count()));
    say("axisd.v1.AxisService/Jog", request.SerializeAsString(), late);
  }
  void stop(std::string_view kind = "Halt", Duration late = {}) {
    v1::HaltRequest request;  // Stop and QuickStop have the axis at the same place
    request.set_axis("feeder");
    say("axisd.v1.AxisService/" + std::string(kind), request.SerializeAsString(), late);
  }
  /// Of the n-th call.
  void answer(std::size_t call, v1::CommandState state = v1::COMMAND_STATE_ACTIVE) {
    v1::JogResponse response;
    response.mutable_command()->set_state(state);
    note(lane.answered(numbers.at(call), {}, response.SerializeAsString(), now));
  }
  void fail(std::size_t call, int code, const std::string& details = {}) {
    note(lane.answered(numbers.at(call), {.code = code, .message = {}, .details = details}, {}, now));
  }
  void wait(Duration duration) {
    const auto end = now + duration;
    while (lane.next_due() <= end) {
      now = std::max(now, lane.next_due());
      note(lane.pass(now));
    }
    now = end;
  }
  void close() { note(lane.close(now)); }
  [[nodiscard]] Jogging feeder() const { return lane.jogging("feeder"); }
  [[nodiscard]] std::vector<std::string> taken() { return std::exchange(log, {}); }
  /// A jog that runs.
  void run() {
    echo();
    jog();
    answer(0);
    (void)taken();
    ASSERT_EQ(feeder(), Jogging::running);
  }

  TimePoint now{Duration(1h)};
  std::uint64_t random = 0x0123456789ABCDEF;
  LaneState lane{[this] { return ++random; }};
  std::string press = "press-1", number;
  std::vector<std::string> log, messages;
  std::vector<std::uint64_t> numbers;
  std::vector<Duration> patience;
  std::uint32_t last_id = 0;
};

}  // namespace axisd::web
