#include "api/axisctl/commission/procedure.hpp"

#include <fmt/format.h>
#include <google/protobuf/util/time_util.h>

#include <algorithm>
#include <cmath>

#include "api/axisctl/commission/record.hpp"
#include "api/axisctl/duration.hpp"
#include "api/axisctl/error.hpp"
#include "api/axisctl/explain_view.hpp"
#include "api/axisctl/format.hpp"

namespace axisd::axisctl::commission {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds sample_period(20);
/// A halt at a limit ends within this; the daemon itself gives up earlier.
constexpr milliseconds settle_time(5000);

void set_judgement(Step& step, const Judgement& judgement) {
  step.set_verdict(judgement.verdict);
  step.set_reason(judgement.reason);
  step.set_remedy(judgement.remedy);
}

/// All that is of one attempt.
void forget_attempt(Step& step) {
  step.clear_verdict();
  step.clear_reason();
  step.clear_remedy();
  step.clear_figures();
  step.clear_edges();
  step.clear_commands();
  step.clear_answers();
}

}  // namespace

void Procedure::run() {
  read_settings();
  const auto state = axis_.state();
  steps_ = plan_steps(state, settings_);
  for (const auto& plan : steps_) record_.add_steps()->set_name(plan.name);
  keep_();
  for (std::size_t i = 0; i < steps_.size(); ++i) {
    auto& step = *record_.mutable_steps(static_cast<int>(i));
    try {
      carry_out(steps_[i], step);
    } catch (const std::exception& end) {
      if (step.verdict() == VERDICT_UNSPECIFIED)
        set_judgement(step, {.verdict = VERDICT_NOT_DONE, .reason = end.what(), .remedy = {}});
      *step.mutable_ended_at() = now();
      throw;
    }
    keep_();
  }
}

void Procedure::read_settings() {
  const auto config = axis_.configuration();
  record_.set_configuration_path(config.path());
  record_.set_configuration_revision(config.revision());
  auto read = settings_of(config.yaml(), config.path(), axis_.name());
  settings_ = std::move(read.settings);
  if (!settings_) {
    person_.tell(
        fmt::format("The configuration cannot be read here, so that polarity, soft limits and homing are not "
                    "known: {}",
                    read.why_not));
    return;
  }
  if (const auto budget = axis_.budget(axis_.state().bus()))
    settings_ = with_braking(*std::move(settings_), seconds(budget->deceleration_time()));
}

void Procedure::carry_out(const StepPlan& plan, Step& step) {
  *step.mutable_began_at() = now();
  if (!plan.not_applicable.empty())
    set_judgement(step, {.verdict = VERDICT_NOT_APPLICABLE, .reason = plan.not_applicable, .remedy = {}});
  else if (auto why = obstacle(plan, steps_, record_); !why.empty())
    set_judgement(step, {.verdict = VERDICT_NOT_DONE, .reason = std::move(why), .remedy = {}});
  bool again = step.verdict() == VERDICT_UNSPECIFIED;
  if (again) person_.tell(fmt::format("\n--- {}", plan.name));
  while (again) {
    forget_attempt(step);
    step.set_attempts(step.attempts() + 1);
    const auto judgement = judged_attempt(plan, step);
    // The stop of an interrupt shows in what a step observes before the interrupt itself is looked at.
    if (judgement.verdict == VERDICT_FAILED && axis_.stopped_at_once()) throw Ended(true, "interrupted");
    set_judgement(step, judgement);
    person_.tell(fmt::format("{}: {}{}{}{}{}", plan.name, verdict_text(step.verdict()),
                             step.reason().empty() ? "" : ": ", step.reason(),
                             step.remedy().empty() ? "" : "\n  -> ", step.remedy()));
    keep_();
    again = step.verdict() == VERDICT_FAILED &&
            dialogue_.choose("Try it again, or go on?", {"again", "go-on"}, step) == "again";
  }
  *step.mutable_ended_at() = now();
}

Judgement Procedure::judged_attempt(const StepPlan& plan, Step& step) {
  try {
    return attempt(plan, step);
  } catch (const StepEnd& end) {
    return end.judgement();
  } catch (const Failure& failure) {
    if (failure.code() != ExitCode::refused) throw;
    return {.verdict = VERDICT_FAILED, .reason = failure.what(), .remedy = {}};
  }
}

Judgement Procedure::attempt(const StepPlan& plan, Step& step) {
  switch (plan.kind) {
    case StepKind::identity:
      return identity(step);
    case StepKind::release:
      return release(step);
    case StepKind::input:
      return actuate(plan, step);
    case StepKind::enable:
      return enable(step);
    case StepKind::jog:
      return jog(plan, step);
    case StepKind::one_frame:
      return one_frame();
    case StepKind::limit:
      return limit(plan, step);
    case StepKind::stop:
      return stop(step);
    case StepKind::home:
      return home(step);
    case StepKind::soft_limits:
      return soft_limits();
    case StepKind::disable:
      return disable(step);
  }
  return {};
}

void Procedure::permit(const std::string& question, Step& step) {
  auto permission = dialogue_.permit(question, step);
  if (axis_.ours()) check_lease();
  if (!permission.granted) throw StepEnd(VERDICT_SKIPPED, std::move(permission.reason));
}

void Procedure::check_lease() const {
  if (const auto lost = axis_.lease_lost(); !lost.empty()) throw Ended(false, "the lease is over: " + lost);
}

void Procedure::check_move(double distance, double velocity) {
  (void)settled();
  const auto response = axis_.explain_move(distance, velocity);
  if (!is_blocked(response)) return;
  person_.tell(explanation(response, axis_.name(), "the move", false));
  const auto first = std::ranges::find_if(response.obstacles(), &v1::Obstacle::blocking);
  auto detail = first->detail();
  detail.clear_remedy();
  throw StepEnd(VERDICT_FAILED, "the move is refused: " + describe(detail, axis_.name()),
                first->detail().remedy());
}

std::string Procedure::with_sign(double value, const std::string& unit) const {
  return fmt::format("{}{}", value > 0 ? "+" : "", with_unit(value, unit));
}

std::string Procedure::move_text(double distance, double velocity, const v1::AxisState& from) const {
  const auto& unit = record_.unit();
  return fmt::format("It moves {} at {} ({}), from {} to {}", with_sign(distance, unit),
                     with_unit(velocity, unit + "/s"),
                     duration_text(duration_of(std::abs(distance), velocity, settings_)),
                     with_unit(from.position(), unit), with_unit(from.position() + distance, unit));
}

Procedure::Run Procedure::follow(v1::Command command, Step& step,
                                 const std::function<bool(const v1::AxisState&)>& watch) {
  Run run;
  for (;;) {
    auto state = axis_.state();
    if (!run.samples.empty())
      state.set_position(unwrapped(state.position(), run.samples.back().position(), settings_));
    if (run.samples.empty() || run.samples.back().measured_at() < state.measured_at())
      run.samples.push_back(state);
    command = axis_.command(command.id());
    record_.set_client(command.client());
    if (ended(command)) {
      *step.add_commands() = command;
      break;
    }
    check_lease();
    if (watch && !watch(state)) break;
    if (!person_.line_within(sample_period)) continue;
    const auto stop = axis_.stop(false);
    *step.add_commands() = axis_.command(command.id());
    *step.add_commands() = stop;
    throw StepEnd(VERDICT_FAILED, stop.state() == v1::COMMAND_STATE_DONE
                                      ? "stopped by the operator"
                                      : "stopped by the operator; standstill is NOT confirmed");
  }
  run.command = std::move(command);
  return run;
}

v1::AxisState Procedure::settled() {
  for (auto left = settle_time;; left -= sample_period) {
    auto state = axis_.state();
    // A stop may still be owed to a drive that rests already: then no move is accepted.
    const bool rests =
        !state.moving() && state.state() != v1::STATE_STOPPING &&
        blocked_by(axis_.explain_move(motion_.distance, motion_.velocity), v1::REASON_MOVING) == nullptr;
    if (rests || left.count() <= 0) return state;
    (void)person_.line_within(sample_period);
  }
}

bool Procedure::wait_until(const std::function<bool()>& condition, Step& step) {
  for (auto left = wishes_.patience; !condition(); left -= sample_period) {
    if (left.count() <= 0) return false;
    check_lease();
    const auto line = person_.line_within(sample_period);
    if (line && !line->empty() && (line->front() == 's' || line->front() == 'S')) {
      const auto reason = person_.ask("Why is it left out?").value_or("");
      auto& kept = *step.add_answers();
      kept.set_question("while it was waited for the hand");
      kept.set_answer("skip: " + reason);
      *kept.mutable_at() = now();
      throw StepEnd(VERDICT_SKIPPED, reason.empty() ? "no reason given" : reason);
    }
    if (line && !line->empty() && (line->front() == 'a' || line->front() == 'A'))
      throw Ended(false, "aborted by the operator");
  }
  return true;
}

bool Procedure::is_active(const std::string& terminal) {
  const auto state = axis_.state();
  const auto found = std::ranges::find(state.inputs(), terminal, &v1::Terminal::name);
  return found != state.inputs().end() && found->active();
}

ExpectedInput Procedure::expected(const StepPlan& plan) const {
  ExpectedInput input{
      .axis = axis_.name(), .terminal = plan.terminal, .function = plan.function, .active = {}};
  const auto found = std::ranges::find(record_.inputs(), plan.terminal, &Input::terminal);
  if (found != record_.inputs().end()) input.active = found->active();
  return input;
}

}  // namespace axisd::axisctl::commission
