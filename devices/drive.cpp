// What stands in for the facets that a model lacks.
#include "devices/drive.hpp"

#include <cstdlib>

namespace axisd {

Task<Result<std::optional<DriveSample>>> Drive::watch_state(StateWatch watch) {
  if (facets_.repeated_watch != nullptr)
    co_return co_await facets_.repeated_watch->watch_state(std::move(watch));
  co_return co_await read_state(TransactionClass::idle_state);
}

Task<Result<Drift>> Drive::check_drift(TransactionOptions options) {
  if (facets_.drift == nullptr) co_return Drift{};
  co_return co_await facets_.drift->check_drift(std::move(options));
}

Task<Result<std::unique_ptr<LoadedMove>>> Drive::load_move(MoveProfile profile, MotionGuard guard) {
  if (facets_.loading == nullptr)
    co_return fail(Reason::not_supported, "the drive cannot be loaded with a move that starts later",
                   "move the axis by itself");
  co_return co_await facets_.loading->load_move(profile, std::move(guard));
}

std::string_view Drive::no_common_start() const {
  return facets_.common_start != nullptr ? facets_.common_start->no_common_start()
                                         : "its bus has no common trigger";
}

Task<Result<std::unique_ptr<PreparedMove>>> Drive::prepare_move(MoveProfile profile, MotionGuard guard) {
  if (facets_.common_start == nullptr)
    co_return fail(Reason::not_supported, std::string(no_common_start()), "start it by itself");
  co_return co_await facets_.common_start->prepare_move(profile, std::move(guard));
}

std::optional<ContinuityMark> Drive::continuity_mark() const {
  return facets_.marks != nullptr ? facets_.marks->continuity_mark() : std::nullopt;
}

void Drive::expect_marks(const std::vector<ContinuityMark>& marks) {
  if (facets_.marks != nullptr) facets_.marks->expect_marks(marks);
}

std::vector<ContinuityMark> Drive::marks_until(const MoveProfile& start) const {
  return facets_.marks != nullptr ? facets_.marks->marks_until(start) : std::vector<ContinuityMark>{};
}

std::vector<ContinuityMark> Drive::marks_until(const VelocityProfile& start) const {
  return facets_.marks != nullptr ? facets_.marks->marks_until(start) : std::vector<ContinuityMark>{};
}

bool Drive::rules_out_restart(const DriveSample& sample) const {
  return facets_.proof != nullptr ? facets_.proof->rules_out_restart(sample) : counts_on(sample);
}

std::optional<TimePoint> Drive::proven_at() const {
  return facets_.proof != nullptr ? facets_.proof->proven_at() : std::nullopt;
}

std::string Drive::link_note() const {
  return facets_.news != nullptr ? facets_.news->link_note() : std::string();
}

void Drive::on_attention(const std::function<void()>& handler) {
  if (facets_.news != nullptr) facets_.news->on_attention(handler);
}

bool Drive::in_trouble() const { return facets_.news != nullptr && facets_.news->in_trouble(); }

std::optional<TimePoint> Drive::stop_sent_at() const {
  return facets_.stops != nullptr ? facets_.stops->stop_sent_at() : std::nullopt;
}

Task<Result<void>> Drive::repeat_stop() {
  return facets_.stops != nullptr ? facets_.stops->repeat_stop() : stop(StopKind::stop);
}

std::optional<Duration> Drive::quick_stop_time(int rpm) const {
  return facets_.stops != nullptr ? facets_.stops->quick_stop_time(rpm) : Duration{};
}

bool Drive::counts_on(const DriveSample& sample) const {
  return !sample.moving && sample.enabled &&
         std::abs(std::int64_t{sample.position_pulses}) > 2 * position_window();
}

}  // namespace axisd
