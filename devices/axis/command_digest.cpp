#include "devices/axis/command_digest.hpp"

#include <fmt/format.h>

#include <utility>

namespace axisd {

namespace {

std::string text_of(const std::optional<double>& value) { return value ? fmt::format("{:a}", *value) : "-"; }
std::string text_of(const std::optional<Duration>& value) {
  return value ? fmt::format("{}", value->count()) : "-";
}
std::string text_of(const MotionValues& values) {
  return fmt::format("{} {} {}", text_of(values.velocity), text_of(values.acceleration_time),
                     text_of(values.deceleration_time));
}

struct DigestOf {
  std::string operator()(const EnableRequest&) const { return "enable"; }
  std::string operator()(const DisableRequest&) const { return "disable"; }
  std::string operator()(const HomeRequest&) const { return "home"; }
  std::string operator()(const ResetRequest&) const { return "reset"; }
  std::string operator()(const MoveAbsoluteRequest& r) const {
    return fmt::format("absolute {:a} {}", r.position, text_of(r.with));
  }
  std::string operator()(const MoveRelativeRequest& r) const {
    return fmt::format("relative {:a} {}", r.distance, text_of(r.with));
  }
  std::string operator()(const MoveVelocityRequest& r) const {
    return fmt::format("velocity {:a} {} {}", r.velocity, text_of(r.hold), text_of(r.with));
  }
  std::string operator()(const JogRequest& r) const {
    return fmt::format("jog {:a} {} {}", r.velocity, r.hold.count(), text_of(r.with));
  }
  std::string operator()(const StopRequest& r) const {
    return fmt::format("stop {} {}", std::to_underlying(r.kind), r.hold);
  }
  std::string operator()(const SetPositionRequest& r) const { return fmt::format("set {:a}", r.position); }
  std::string operator()(const GroupMemberRequest& r) const {
    return fmt::format("group {} {} {} of {}", text_of(r.position), text_of(r.distance), text_of(r.with),
                       r.whole);
  }
};

struct AskedOf {
  static MotionValues with(MotionValues values, std::optional<double> position,
                           std::optional<double> distance) {
    values.position = position;
    values.distance = distance;
    return values;
  }
  MotionValues operator()(const MoveAbsoluteRequest& r) const { return with(r.with, r.position, {}); }
  MotionValues operator()(const MoveRelativeRequest& r) const { return with(r.with, {}, r.distance); }
  MotionValues operator()(const MoveVelocityRequest& r) const {
    auto values = r.with;
    values.velocity = r.velocity;
    values.hold = r.hold;
    return values;
  }
  MotionValues operator()(const JogRequest& r) const {
    auto values = r.with;
    values.velocity = r.velocity;
    values.hold = r.hold;
    return values;
  }
  MotionValues operator()(const SetPositionRequest& r) const { return {.position = r.position}; }
  MotionValues operator()(const GroupMemberRequest& r) const { return with(r.with, r.position, r.distance); }
  template <class Other>
  MotionValues operator()(const Other&) const {
    return {};
  }
};

}  // namespace

std::string digest(const std::string& axis, const Action& action) {
  return axis + " " + std::visit(DigestOf{}, action);
}

MotionValues asked_by(const Action& action) { return std::visit(AskedOf{}, action); }

}  // namespace axisd
