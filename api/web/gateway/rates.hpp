// How often something may be done. Pure.
#pragma once

#include <algorithm>
#include <map>
#include <string>

#include "buses/clock.hpp"

namespace axisd::web {

/// So many in a second, and so many at once.
struct Pace {
  double per_second = 0, at_once = 0;
};

class Rate {
 public:
  explicit Rate(Pace pace) : pace_(pace), left_(pace.at_once) {}

  /// Takes so much, if there is so much, and `kept` besides.
  bool take(TimePoint now, double amount = 1, double kept = 0) {
    const std::chrono::duration<double> passed = now - refilled_;
    left_ = std::min(pace_.at_once, left_ + passed.count() * pace_.per_second);
    refilled_ = now;
    if (left_ < amount + kept) return false;
    left_ -= amount;
    return true;
  }
  /// It is as if nothing had been taken.
  [[nodiscard]] bool rested(TimePoint now) const {
    const std::chrono::duration<double> passed = now - refilled_;
    return left_ + passed.count() * pace_.per_second >= pace_.at_once;
  }

 private:
  Pace pace_;
  double left_;
  TimePoint refilled_{};
};

/// A share for each, and a total: who takes more than a share takes nothing from the others.
class Rates {
 public:
  Rates(Pace total, Pace each) : total_(total), each_(each) {}

  /// `kept`: what is left of the total for others.
  bool take(const std::string& key, TimePoint now, double amount = 1, double kept = 0) {
    if (shares_.size() > 256)
      std::erase_if(shares_, [&](const auto& share) { return share.second.rested(now); });
    auto& share = shares_.try_emplace(key, each_).first->second;
    return share.take(now, amount) && total_.take(now, amount, kept);
  }

 private:
  Rate total_;
  const Pace each_;
  std::map<std::string, Rate, std::less<>> shares_;
};

}  // namespace axisd::web
