// The steps before the power stage is on: what is talked to, and hands at the switches.
#include <fmt/format.h>
#include <google/protobuf/util/time_util.h>

#include <algorithm>

#include "api/axisctl/advice.hpp"
#include "api/axisctl/commission/procedure.hpp"
#include "api/axisctl/commission/record.hpp"
#include "api/axisctl/error.hpp"
#include "api/axisctl/explain_view.hpp"
#include "api/axisctl/format.hpp"

namespace axisd::axisctl::commission {
namespace {

using std::chrono::milliseconds;

/// Other terminals are looked at for so long after the first, and until they were read so often: how often an
/// idle axis is read is its line's affair.
constexpr milliseconds company(200);
constexpr int company_readings = 2;

void add_setting(Record& record, const std::string& name, double value, const std::string& unit) {
  auto& figure = *record.add_settings();
  figure.set_name(name);
  figure.set_value(value);
  figure.set_unit(unit);
}

void keep_settings(Record& record, const Settings& settings) {
  const auto& unit = settings.unit;
  record.clear_settings();
  if (settings.position_minimum && settings.position_maximum) {
    add_setting(record, "position_minimum", *settings.position_minimum, unit);
    add_setting(record, "position_maximum", *settings.position_maximum, unit);
  }
  add_setting(record, "velocity", settings.velocity, unit + "/s");
  add_setting(record, "acceleration_time", settings.acceleration_time, "s");
  add_setting(record, "deceleration_time", settings.deceleration_time, "s");
  add_setting(record, "jog_travel", settings.jog_travel, unit);
  record.clear_inputs();
  for (const auto& input : settings.inputs) *record.add_inputs() = input;
}

std::string inputs_text(const Record& record, const v1::AxisState& state) {
  std::string text;
  for (const auto& terminal : state.inputs()) {
    if (terminal.function().empty()) continue;
    const auto known = std::ranges::find(record.inputs(), terminal.name(), &Input::terminal);
    text += fmt::format("{}{} {}{}, now {}", text.empty() ? "" : "; ", terminal.name(), terminal.function(),
                        known == record.inputs().end() ? "" : " (active " + known->active() + ")",
                        terminal.active() ? "active" : "inactive");
  }
  return text.empty() ? "none has a function" : text;
}

}  // namespace

Judgement Procedure::identity(Step& step) {
  const auto info = axis_.info();
  const auto state = axis_.state();
  const auto drive = axis_.drive();
  record_.set_axisd_version(info.version());
  record_.set_model(state.model());
  if (drive.has_model_code()) record_.set_model_code(drive.model_code());
  record_.set_drive_version(state.drive_version());
  record_.set_bus(state.bus());
  record_.set_node(state.node());
  record_.set_simulated(state.simulated());
  record_.set_unit(state.unit());
  record_.set_position_source(state.position_source());
  if (settings_) keep_settings(record_, *settings_);
  show_identity(state, info, drive);

  if (info.inhibited())
    return {.verdict = VERDICT_FAILED,
            .reason = fmt::format("StopAll of {} holds the machine", info.inhibited_by()),
            .remedy = "axisctl release-stop --all"};
  // From here on nobody else moves it: hands will be at its switches.
  axis_.acquire_lease("commission");
  v1::ExplainRequest enabling;
  enabling.mutable_enable();
  if (const auto response = axis_.explain(enabling); is_blocked(response)) {
    person_.tell(explanation(response, axis_.name(), "enable", false));
    const auto first = std::ranges::find_if(response.obstacles(), &v1::Obstacle::blocking);
    auto detail = first->detail();
    detail.clear_remedy();
    return {.verdict = VERDICT_FAILED,
            .reason = describe(detail, axis_.name()),
            .remedy = advice(first->detail().remedy(), axis_.name())};
  }
  plan_motion();
  permit(fmt::format(
             "Is this the axis that you stand at? Moves will be {} at {}, the first, which is timed, at {}, "
             "and nothing moves before you say yes to it. Go on?",
             with_unit(motion_.distance, record_.unit()), with_unit(motion_.velocity, record_.unit() + "/s"),
             with_unit(proving_velocity(velocities_, motion_.velocity, motion_.distance),
                       record_.unit() + "/s")),
         step);
  return {};
}

void Procedure::show_identity(const v1::AxisState& state, const v1::GetInfoResponse& info,
                              const v1::GetDriveResponse& drive) {
  const auto line = [&](std::string_view name, const std::string& value) {
    person_.tell(fmt::format("  {:<14}{}", name, value));
  };
  line("machine", fmt::format("{} (axisd {}, configuration {})", info.machine(), info.version(),
                              record_.configuration_revision()));
  line("axis", fmt::format("{}{}", state.axis(), state.simulated() ? ", SIMULATED" : ""));
  line("drive", fmt::format("{} at {} node {}: {}", state.model(), state.bus(), state.node(), drive.title()));
  if (drive.has_model_code())
    line("reported", fmt::format("code 0x{:04X}, version {}", drive.model_code(), state.drive_version()));
  line("link", lower_word(v1::LinkState_Name(state.link()), "LINK_STATE_"));
  line("state", fmt::format("{}, power stage {}, position {} ({}, {})", state_text(state),
                            state.enabled() ? "on" : "off", with_unit(state.position(), state.unit()),
                            lower_word(v1::PositionTrust_Name(state.trust()), "POSITION_TRUST_"),
                            state.position_source() == v1::POSITION_SOURCE_ENCODER
                                ? "measured by its encoder"
                                : "counted pulses, lost steps do not show"));
  if (state.has_fault()) line("fault", describe(state.fault(), state.axis()));
  if (settings_) {
    const auto& unit = settings_->unit;
    line("limits", fmt::format("{}, {}",
                               settings_->position_minimum
                                   ? fmt::format("{} to {}", with_unit(*settings_->position_minimum, unit),
                                                 with_unit(*settings_->position_maximum, unit))
                                   : "positions without limits",
                               with_unit(settings_->velocity, unit + "/s")));
    line("ramps",
         fmt::format("acceleration {}, deceleration and stop {}", duration_text(settings_->acceleration_time),
                     duration_text(settings_->deceleration_time)));
    if (settings_->vertical) line("load", "vertical: without power it may fall");
  }
  line("inputs", inputs_text(record_, state));
}

void Procedure::plan_motion() {
  velocities_ = axis_.velocities();
  motion_ = default_motion(velocities_, settings_, wishes_.velocity, wishes_.distance);
  if (motion_.velocity > velocities_.maximum * (1 + 1e-9) ||
      motion_.velocity < velocities_.minimum * (1 - 1e-9))
    throw StepEnd(VERDICT_FAILED,
                  fmt::format("--velocity: {} is out of range (permitted {} to {})",
                              with_unit(motion_.velocity, record_.unit() + "/s"), number(velocities_.minimum),
                              with_unit(velocities_.maximum, record_.unit() + "/s")));
  if (motion_.distance <= 0) throw StepEnd(VERDICT_FAILED, "--distance: must be more than 0");
}

Judgement Procedure::release(Step& step) {
  permit(fmt::format("The power stage is on. It has to be off for hands at the switches{}. Switch it off?",
                     settings_ && settings_->vertical ? "; the load hangs, and may fall without it" : ""),
         step);
  const auto run = follow(axis_.disable(), step);
  if (run.command.state() != v1::COMMAND_STATE_DONE || axis_.state().enabled())
    return {.verdict = VERDICT_FAILED,
            .reason = "it was not switched off: " + command_line(run.command, record_.unit()),
            .remedy = {}};
  return {};
}

void Procedure::wait_for_company(Step& step) {
  auto last = axis_.state().measured_at();
  int readings = 0;
  (void)person_.line_within(company);
  (void)wait_until(
      [&] {
        const auto at = axis_.state().measured_at();
        if (at > last) ++readings;
        last = at;
        return readings >= company_readings;
      },
      step);
}

Judgement Procedure::actuate(const StepPlan& plan, Step& step) {
  const auto input = expected(plan);
  if (axis_.state().enabled())
    throw StepEnd(VERDICT_NOT_DONE, "the power stage is on: no hands at the switches");
  EventFeed feed(axis_.client(), axis_.state());
  const auto collect = [&] {
    for (auto& edge : feed.take()) *step.add_edges() = std::move(edge);
  };
  if (is_active(plan.terminal)) {
    const auto answer = dialogue_.choose(
        fmt::format("{} ({}) is active now. Is it actuated, by the axis standing on it, say?", plan.terminal,
                    plan.function),
        {"yes", "no"}, step);
    if (answer != "yes") return wrong_polarity(input);
    person_.tell("Free it: move the axis away by hand. (s: skip, a: abort)");
    if (!wait_until([&] { return !is_active(plan.terminal); }, step))
      return {.verdict = VERDICT_FAILED, .reason = plan.terminal + " stayed active", .remedy = {}};
    feed.take();
  }
  person_.tell(fmt::format("Actuate {} ({}) by hand, and keep it. Waiting {} (s: skip, a: abort)",
                           plan.terminal, plan.function,
                           duration_text(std::chrono::duration<double>(wishes_.patience).count())));
  const auto any_edge = [&] {
    collect();
    return step.edges_size() > 0;
  };
  if (!wait_until(any_edge, step)) return judge_switch(input, {});
  wait_for_company(step);
  collect();
  const auto first = step.edges(0);
  person_.tell(
      fmt::format("{} is {}. Release it.", first.terminal(), first.active() ? "active" : "inactive"));
  (void)wait_until(
      [&] {
        collect();
        return std::ranges::any_of(step.edges(), [&](const v1::TerminalEdge& edge) {
          return edge.terminal() == first.terminal() && edge.active() != first.active();
        });
      },
      step);
  wait_for_company(step);
  collect();
  return judge_switch(input, {step.edges().begin(), step.edges().end()});
}

}  // namespace axisd::axisctl::commission
