// Work on a rig's drive beside motion.
#pragma once

#include <functional>
#include <optional>
#include <utility>

#include "devices/axis/drive_operations.hpp"
#include "tests/support/rig.hpp"

namespace axisd::test {

/// Runs an operation on the drive to its end.
template <class T>
Result<T> operate(Rig& rig, const std::function<Task<Result<T>>(const DriveOperations&)>& operation) {
  std::optional<Result<T>> result;
  auto run = [](DriveOperations drive, auto what, std::optional<Result<T>>& end) -> Task<> {
    end = co_await what(drive);
  };
  spawn(rig.world.executor(), run(DriveOperations(rig.axis()), operation, result), "operation");
  EXPECT_TRUE(rig.run_until([&] { return result.has_value(); }, std::chrono::seconds(20)));
  return result ? std::move(*result) : Result<T>(fail(Reason::internal, "did not end"));
}

}  // namespace axisd::test
