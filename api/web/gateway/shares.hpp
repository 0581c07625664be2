// Limits with a share for each and a total. Pure.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>

namespace axisd::web {

/// Places, so many in all and so many for each key. Outlives what it gave away. Thread: one at a time.
class Shares {
 public:
  /// One place; given back with it.
  class Place {
   public:
    Place(Place&& other) noexcept
        : shares_(std::exchange(other.shares_, nullptr)), key_(std::move(other.key_)) {}
    Place& operator=(Place&& other) noexcept {
      std::swap(shares_, other.shares_);
      std::swap(key_, other.key_);
      return *this;
    }
    ~Place() {
      if (shares_ != nullptr) shares_->give_back(key_);
    }

   private:
    friend class Shares;
    Place(Shares* shares, std::string key) : shares_(shares), key_(std::move(key)) {}
    Shares* shares_;
    std::string key_;
  };

  Shares(int total, int each) : total_(total), each_(each) {}
  Shares(const Shares&) = delete;

  /// Nothing: this key, or all of them, have as many as they may.
  [[nodiscard]] std::optional<Place> take(const std::string& key) {
    const auto found = taken_.find(key);
    if (count_ >= total_ || (found != taken_.end() && found->second >= each_)) return std::nullopt;
    ++taken_[key];
    ++count_;
    return Place(this, key);
  }
  [[nodiscard]] int count() const { return count_; }
  [[nodiscard]] bool full() const { return count_ >= total_; }

 private:
  void give_back(const std::string& key) {
    const auto found = taken_.find(key);
    if (--found->second == 0) taken_.erase(found);
    --count_;
  }

  const int total_, each_;
  int count_ = 0;
  std::map<std::string, int, std::less<>> taken_;
};

}  // namespace axisd::web
