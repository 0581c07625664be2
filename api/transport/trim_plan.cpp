#include "api/transport/trim_plan.hpp"

#include <algorithm>
#include <utility>

namespace axisd::transport {

void TrimPlan::let_go(TimePoint now) {
  owed_ = tries;
  pause_ = first_pause;
  next_ = std::max(next_, now + settled_after);
}

bool TrimPlan::due(TimePoint now, std::size_t resident) {
  if (resident == 0) return false;
  if (resident >= left_ + worth && owed_ < tries) {
    owed_ = tries;
    pause_ = first_pause;
  }
  if (resident < start_ + worth) owed_ = 0;
  if (owed_ == 0 || now < next_) return false;
  --owed_;
  left_ = resident;  // unless trimmed() tells better
  next_ = now + std::exchange(pause_, 2 * pause_);
  return true;
}

void TrimPlan::trimmed(std::size_t resident) {
  if (resident > 0) left_ = resident;
}

}  // namespace axisd::transport
