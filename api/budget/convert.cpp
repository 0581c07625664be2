#include "api/budget/convert.hpp"

#include <google/protobuf/util/time_util.h>

namespace axisd::api {
namespace {

/// Left unset: without bound, not seen, or of nothing.
template <class Message>
void set(Duration time, google::protobuf::Duration* (Message::*field)(), Message& to) {
  if (time == Duration{} || time == Duration::max()) return;
  *(to.*field)() = google::protobuf::util::TimeUtil::NanosecondsToDuration(time.count());
}

void to_proto(const LoadBudget& from, v1::LoadBudget& to) {
  to.set_moving(static_cast<std::uint32_t>(from.moving));
  to.set_utilisation(from.utilisation);
  to.set_utilisation_max(from.utilisation_max);
  set(from.refresh_moving, &v1::LoadBudget::mutable_refresh_moving, to);
  set(from.refresh_idle, &v1::LoadBudget::mutable_refresh_idle, to);
  set(from.start, &v1::LoadBudget::mutable_start, to);
}

void to_proto(const StopBudget& from, v1::StopBudget& to) {
  to.set_axes(static_cast<std::uint32_t>(from.axes));
  set(from.last_frame, &v1::StopBudget::mutable_last_frame, to);
  set(from.standstill, &v1::StopBudget::mutable_standstill, to);
}

void to_proto(const ObservedAxis& from, v1::ObservedTimes& to) {
  set(from.refresh_idle, &v1::ObservedTimes::mutable_refresh_idle, to);
  set(from.refresh_moving, &v1::ObservedTimes::mutable_refresh_moving, to);
  set(from.stop_frame, &v1::ObservedTimes::mutable_stop_frame, to);
  set(from.standstill, &v1::ObservedTimes::mutable_standstill, to);
  set(from.stop_frame_all, &v1::ObservedTimes::mutable_stop_frame_all, to);
  set(from.standstill_all, &v1::ObservedTimes::mutable_standstill_all, to);
}

void to_proto(const AxisBudgetReport& from, v1::AxisBudget& to) {
  to.set_axis(from.predicted.axis);
  set(from.predicted.refresh_idle, &v1::AxisBudget::mutable_refresh_idle, to);
  set(from.predicted.refresh_moving, &v1::AxisBudget::mutable_refresh_moving, to);
  set(from.predicted.refresh_moving_all, &v1::AxisBudget::mutable_refresh_moving_all, to);
  to_proto(from.predicted.alone, *to.mutable_stop_alone());
  to_proto(from.predicted.all, *to.mutable_stop_all());
  set(from.deceleration, &v1::AxisBudget::mutable_deceleration_time, to);
  to.set_unit(from.unit);
  to.set_way_alone(from.way_alone);
  to.set_way_all(from.way_all);
  to_proto(from.observed, *to.mutable_observed());
}

}  // namespace

void to_proto(const BusBudgetReport& from, v1::BusBudget& to) {
  to.set_bus(from.predicted.bus);
  for (const auto& load : from.predicted.load) to_proto(load, *to.add_load());
  for (const auto& stop : from.predicted.stops) to_proto(stop, *to.add_stops());
  for (const auto& axis : from.axes) to_proto(axis, *to.add_axes());
  for (const auto& one : from.excess) {
    auto& excess = *to.add_excess();
    excess.set_key(one.key);
    excess.set_message(one.text);
    excess.set_remedy(one.remedy);
  }
  for (const auto& note : from.predicted.notes) to.add_notes(note);
}

}  // namespace axisd::api
