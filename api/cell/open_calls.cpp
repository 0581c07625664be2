#include "api/cell/open_calls.hpp"

namespace axisd::cell {

bool OpenCalls::enter(const std::string& caller, Kind kind) {
  const std::lock_guard lock(mutex_);
  auto& share = shares_[caller];
  const bool room = kind == Kind::stop ? share.stops < limits_.stops_each
                                       : share.counted < limits_.each && counted_ < limits_.all;
  if (!room) {
    if (share.counted == 0 && share.stops == 0) shares_.erase(caller);
    return false;
  }
  ++(kind == Kind::stop ? share.stops : share.counted);
  ++(kind == Kind::stop ? stops_ : counted_);
  return true;
}

void OpenCalls::leave(const std::string& caller, Kind kind) {
  const std::lock_guard lock(mutex_);
  const auto found = shares_.find(caller);
  auto& share = found->second;
  --(kind == Kind::stop ? share.stops : share.counted);
  --(kind == Kind::stop ? stops_ : counted_);
  if (share.counted == 0 && share.stops == 0) shares_.erase(found);
}

int OpenCalls::open() const {
  const std::lock_guard lock(mutex_);
  return counted_ + stops_;
}

}  // namespace axisd::cell
