// Times as protobuf messages.
#pragma once

#include <google/protobuf/duration.pb.h>
#include <google/protobuf/timestamp.pb.h>

#include <chrono>

namespace axisd::axisctl {

inline void set(google::protobuf::Duration& message, std::chrono::nanoseconds value) {
  message.set_seconds(value.count() / 1'000'000'000);
  message.set_nanos(static_cast<int>(value.count() % 1'000'000'000));
}

/// The wall-clock time that lies `ahead` of now.
inline void set_ahead(google::protobuf::Timestamp& message, std::chrono::nanoseconds ahead) {
  const auto then = std::chrono::system_clock::now().time_since_epoch() + ahead;
  message.set_seconds(std::chrono::duration_cast<std::chrono::seconds>(then).count());
  message.set_nanos(static_cast<int>(
      (std::chrono::duration_cast<std::chrono::nanoseconds>(then) % std::chrono::seconds(1)).count()));
}

/// By the wall clock.
inline google::protobuf::Timestamp now() {
  google::protobuf::Timestamp time;
  set_ahead(time, std::chrono::nanoseconds(0));
  return time;
}

}  // namespace axisd::axisctl
