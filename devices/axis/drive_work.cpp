#include "devices/axis/drive_work.hpp"

#include "devices/axis/drift_check.hpp"
#include "devices/axis/execution.hpp"
#include "devices/axis/preconditions.hpp"

namespace axisd {

Result<std::shared_ptr<void>> DriveWork::begin_maintenance() {
  if (auto online = preconditions_.check_online(); !online) return fail(online.error());
  if (!maintenance_.expired() || execution_.activity())
    return fail(context_.error(Reason::busy, "something else is being done to the drive", "wait for it"));
  if (!execution_.at_rest() || shaft_.terminal_motion().moves())
    return fail(context_.error(Reason::moving, "the axis moves", "wait for standstill"));
  if (!shaft_.sample() || shaft_.sample()->enabled)
    return fail(context_.error(Reason::moving, "the power stage is on: what is written could move the motor",
                               "disable the axis first"));
  auto token = std::make_shared<int>(0);
  maintenance_ = token;
  drift_.give_up_comparison();
  return token;
}

}  // namespace axisd
