// What must survive a restart, in memory; can be slow, and can fail as a full disk does.
#pragma once

#include <utility>
#include <vector>

#include "devices/persistence.hpp"
#include "tests/support/virtual_world.hpp"

namespace axisd::test {

class FakePersistence final : public Persistence {
 public:
  explicit FakePersistence(Executor executor) : executor_(std::move(executor)) {}

  bool failing = false;  ///< saves fail with Error `storage`
  bool frozen = false;   ///< the process is dead: nothing is saved any more
  bool slow = false;     ///< nothing is answered until release()
  StoredState saved;     ///< what the file holds now
  KeptStateSeen seen_files{};
  /// What the next daemon finds when it starts.
  void restart() { loaded_ = saved; }
  /// The disk answers.
  void release() {
    slow = false;
    for (auto& held : std::exchange(held_, {})) answer(std::move(held));
  }

  [[nodiscard]] const StoredState& loaded() const override { return loaded_; }
  [[nodiscard]] const StoredState& current() const override { return saved; }
  [[nodiscard]] KeptStateSeen seen() const override { return seen_files; }
  void save_offset(std::string axis, OffsetRecord offset, Callback done) override {
    if (!failing && !frozen) saved.axes[axis].offset = offset;
    answer(std::move(done));
  }
  void forget_offset(std::string axis, Callback done) override {
    if (!failing && !frozen) saved.axes[axis].offset.reset();
    answer(std::move(done));
  }
  void save_inhibit(InhibitRecord inhibit, Callback done) override {
    if (!failing && !frozen) saved.inhibit = std::move(inhibit);
    answer(std::move(done));
  }
  void save_hold(std::string axis, HoldKey hold, WallTime since, Callback done) override {
    if (!failing && !frozen) saved.axes[axis].holds.insert_or_assign(std::move(hold), since);
    answer(std::move(done));
  }
  void forget_holds(std::string axis, HoldRecords holds, Callback done) override {
    if (!failing && !frozen)
      for (const auto& [hold, since] : holds) saved.axes[axis].holds.erase(hold);
    answer(std::move(done));
  }
  void count_eeprom_writes(std::string axis, std::uint64_t writes, EepromRecord saves,
                           Callback done) override {
    if (!failing && !frozen) {
      saved.axes[axis].eeprom_writes += writes;
      saved.axes[axis].eeprom = std::move(saves);
    }
    answer(std::move(done));
  }
  void accept_state(Callback done) override {
    if (!failing && !frozen) saved.convictions.clear();
    answer(std::move(done));
  }

 private:
  void answer(Callback done) {
    if (!done) return;
    if (slow) {
      held_.push_back(std::move(done));
      return;
    }
    Result<void> result;
    if (failing) result = fail(Reason::storage, "the disk is full", "free some space");
    post(executor_, [done = std::move(done), result] { done(result); });
  }

  Executor executor_;
  StoredState loaded_;
  std::vector<Callback> held_;
};

}  // namespace axisd::test
