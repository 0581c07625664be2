#include "api/axisctl/state_view.hpp"

#include <fmt/format.h>

#include <set>

#include "api/axisctl/error.hpp"
#include "api/axisctl/format.hpp"
#include "api/axisctl/hold_view.hpp"

namespace axisd::axisctl {
namespace {

Colour state_colour(const v1::AxisState& state) {
  if (state.link() == v1::LINK_STATE_OFFLINE || state.state() == v1::STATE_ERROR_STOP) return Colour::red;
  switch (state.state()) {
    case v1::STATE_HOMING:
    case v1::STATE_DISCRETE_MOTION:
    case v1::STATE_CONTINUOUS_MOTION:
    case v1::STATE_SYNCHRONIZED_MOTION:
      return Colour::green;
    case v1::STATE_STOPPING:
      return Colour::yellow;
    case v1::STATE_DISABLED:
      return Colour::dim;
    default:
      return Colour::none;
  }
}

void append(std::string& text, std::string_view more) {
  if (!text.empty()) text += ", ";
  text += more;
}

std::string trust(const v1::AxisState& state) {
  return lower_word(v1::PositionTrust_Name(state.trust()), "POSITION_TRUST_");
}

std::string link(const v1::AxisState& state) {
  return lower_word(v1::LinkState_Name(state.link()), "LINK_STATE_");
}

std::string terminals(const google::protobuf::RepeatedPtrField<v1::Terminal>& all) {
  std::string text;
  for (const auto& terminal : all)
    append(text, fmt::format("{}{}{}={}", terminal.name(), terminal.function().empty() ? "" : " ",
                             terminal.function(), terminal.active() ? "on" : "off"));
  return text;
}

/// "name:   value" lines, aligned; empty values are left out.
class Details {
 public:
  void add(std::string_view name, const std::string& value) {
    if (!value.empty()) text_ += fmt::format("{:<12}{}\n", fmt::format("{}:", name), value);
  }
  [[nodiscard]] std::string text() && { return std::move(text_); }

 private:
  std::string text_;
};

/// Who set it in motion, if that was not a command.
std::string foreign_motion(const v1::AxisState& state) {
  if (state.motion_cause() == v1::MOTION_CAUSE_TERMINAL) return "started by a terminal";
  if (state.motion_cause() == v1::MOTION_CAUSE_UNKNOWN) return "started by nobody that is known";
  return "";
}

/// A value that its drive said; "-" where it never said any.
std::string measured(const v1::AxisState& state, double value, std::string_view unit) {
  return state.has_age() ? with_unit(value, unit) : "-";
}

/// A drive that never said anything is in no state that is known.
std::string state_of(const v1::AxisState& state) {
  return state.has_age() || state.link() == v1::LINK_STATE_OFFLINE ? state_text(state) : "-";
}

std::string position(const v1::AxisState& state) {
  if (!state.has_age()) return "never measured";
  const auto text = with_unit(state.position(), state.unit()) + " (" + trust(state);
  if (state.position_source() == v1::POSITION_SOURCE_COMMANDED) return text + ", counted pulses)";
  if (state.position_source() == v1::POSITION_SOURCE_ENCODER) return text + ", encoder)";
  return text + ")";
}

std::string power(const v1::AxisState& state) {
  if (!state.has_age()) return "not known";
  if (!state.enabled()) return "off";
  return state.enabled_by_daemon() ? "on" : "on, found so: nobody enabled it through this daemon";
}

/// Their names alone, each once.
std::string holders(const v1::AxisState& state) {
  std::set<std::string> names;
  for (const auto& hold : state.holds()) names.insert(hold.holder());
  return fmt::format("{}", fmt::join(names, ", "));
}

}  // namespace

std::string remarks(const v1::AxisState& state) {
  std::string text;
  if (state.simulated()) append(text, "simulated");
  if (state.link() != v1::LINK_STATE_ONLINE && state.has_age())
    append(text, fmt::format("last measured {} ago", duration_text(seconds(state.age()))));
  if (state.inhibited()) append(text, "all stopped");
  if (state.stop_held()) append(text, "stop held by " + holders(state));
  if (!state.lease_holder().empty()) append(text, "leased by " + state.lease_holder());
  if (state.alarm_code() != 0)
    append(text, fmt::format("alarm {} {}", alarm_text(state.alarm_code()), state.alarm_name()));
  if (const auto cause = foreign_motion(state); !cause.empty()) append(text, cause);
  if (!state.drift().empty()) append(text, "drift: " + state.drift());
  if (state.enabled() && !state.enabled_by_daemon()) append(text, "not enabled by us");
  if (state.has_fault() && state.alarm_code() == 0) append(text, state.fault().message());
  if (state.has_link_error()) append(text, state.link_error().message());
  if (!state.link_note().empty()) append(text, state.link_note());
  return text;
}

Table axis_table(const google::protobuf::RepeatedPtrField<v1::AxisState>& axes) {
  Table table(
      {"AXIS", "STATE", "POSITION", "", "VELOCITY", "", "TRUST", "LINK", "MODEL", "BUS", "NODE", "REMARKS"},
      {2, 4, 10});
  table.leave_out_first({10, 9, 8, 7});  // 'axisctl state' has them
  for (const auto& state : axes) {
    const bool known = state.has_age();
    table.add({state.axis(),
               {state_of(state), state_colour(state)},
               known ? number(state.position()) : "-",
               known ? state.unit() : "",
               known ? number(state.velocity()) : "-",
               known ? state.unit() + "/s" : "",
               trust(state),
               link(state),
               state.model(),
               state.bus(),
               std::to_string(state.node()),
               {remarks(state), state.has_fault() || state.has_link_error() || !state.drift().empty()
                                    ? Colour::red
                                    : Colour::none}});
  }
  return table;
}

std::string state_details(const v1::AxisState& state, bool colour) {
  Details details;
  details.add("axis", state.axis() + (state.simulated() ? " (simulated)" : ""));
  details.add("state", coloured(state_of(state), state_colour(state), colour) +
                           (state.in_position() ? ", in position" : "") +
                           (state.stop_held() ? ", stop held by all of: " + text_of(state.holds()) : "") +
                           (state.inhibited() ? ", all axes stopped: release-stop --all" : ""));
  if (state.has_fault())
    details.add("fault", coloured(describe(state.fault(), state.axis()), Colour::red, colour));
  if (state.alarm_code() != 0)
    details.add("alarm", fmt::format("{} {}", alarm_text(state.alarm_code()), state.alarm_name()));
  if (!state.drift().empty()) details.add("drift", coloured(state.drift(), Colour::red, colour));
  details.add("power", power(state));
  details.add("position", position(state));
  if (state.has_commanded_position())
    details.add("commanded",
                fmt::format("{} (following error {})", with_unit(state.commanded_position(), state.unit()),
                            with_unit(state.following_error(), state.unit())));
  if (state.has_target()) details.add("target", with_unit(state.target(), state.unit()));
  if (state.has_age()) details.add("velocity", with_unit(state.velocity(), state.unit() + "/s"));
  if (state.moving())
    details.add("motion", foreign_motion(state).empty() ? "by command" : foreign_motion(state));
  details.add("command", state.command_id());
  if (!state.lease_holder().empty()) details.add("lease", state.lease_holder());
  if (state.has_age()) {
    details.add("inputs", terminals(state.inputs()));
    details.add("outputs", terminals(state.outputs()));
  }
  details.add("drive",
              fmt::format("{}{}{} on {} node {}", state.model(), state.drive_version().empty() ? "" : " ",
                          state.drive_version(), state.bus(), state.node()));
  details.add("link", link(state));
  if (state.has_link_error())
    details.add("link error", coloured(describe(state.link_error(), state.axis()), Colour::red, colour));
  if (state.starts_by_sync())
    details.add("in a group", "starts by SYNC");
  else if (!state.start_note().empty())
    details.add("in a group", "starts alone, not by SYNC: " + state.start_note());
  if (state.has_age()) details.add("measured", duration_text(seconds(state.age())) + " ago");
  if (state.eeprom_writes() > 0)
    details.add("EEPROM", fmt::format("{} register{} saved", state.eeprom_writes(),
                                      state.eeprom_writes() == 1 ? "" : "s"));
  if (state.drive_reboots() > 0) details.add("reboots", std::to_string(state.drive_reboots()));
  return std::move(details).text();
}

std::string tick_line(const v1::WatchAxesResponse& batch) {
  std::string text = std::to_string(batch.tick());
  for (const auto& state : batch.axes())
    text += fmt::format("  {} {} {} {}", state.axis(), state_of(state),
                        measured(state, state.position(), state.unit()),
                        measured(state, state.velocity(), state.unit() + "/s"));
  return text;
}

}  // namespace axisd::axisctl
