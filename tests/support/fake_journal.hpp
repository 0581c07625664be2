// The command journal, in memory; can be slow, and can fail as a full disk does.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "daemon/store/journal_model.hpp"
#include "tests/support/virtual_world.hpp"

namespace axisd::test {

class FakeJournal final : public CommandJournal {
 public:
  /// With a clock ages go on over restarts; without one nothing gets any older.
  explicit FakeJournal(Executor executor, Clock* clock = nullptr)
      : executor_(std::move(executor)), clock_(clock) {}

  std::string text{store::journal_header};  ///< what the file holds
  bool failing = false;                     ///< as a full disk: writes fail
  bool frozen = false;                      ///< the process is dead: nothing is written any more
  bool slow = false;                        ///< the disk does not answer until release()
  int durable = 0;                          ///< starts that were to be made durable

  /// What the next daemon finds when it starts.
  void restart(WallTime now) {
    held_.clear();
    auto load = store::load_journal(text);
    if (!load.damage.empty())
      load.model.apply(store::DoubtLine{.until = now + longest_validity, .damage = load.damage});
    if (clock_ != nullptr) load.model.apply(load.model.time_after("boot", clock_->now().time_since_epoch()));
    loaded_ = load.model.content();
    text = store::journal_header;
    number_ = 0;
    for (const auto& line : load.model.lines()) text += store::encode_line(++number_, line);
  }
  /// The disk answers.
  void release() {
    slow = false;
    for (auto& held : std::exchange(held_, {})) write(std::move(held.first), std::move(held.second));
  }

  [[nodiscard]] JournalContent take_loaded() override { return std::exchange(loaded_, {}); }
  [[nodiscard]] std::optional<Error> trouble() const override {
    return failing && told_ ? std::optional(full()) : std::nullopt;
  }
  void accepted(const Command& command, std::string digest) override {
    write(store::AcceptedLine{.command = command, .digest = std::move(digest)}, {});
  }
  void attached(const std::string& command, RequestKey request, Callback done) override {
    write(store::AttachedLine{.command = command, .request = std::move(request)}, std::move(done));
  }
  void sending(const Command& command, SendingNote note, Callback done) override {
    if (done) ++durable;
    write(store::SendingLine{.command = command, .note = std::move(note)}, std::move(done));
  }
  void ended(const Command& command) override { write(store::EndedLine{.command = command}, {}); }
  void heard(const Command& command, RequestKey request) override {
    write(store::HeardLine{.command = command, .request = std::move(request)}, {});
  }

 private:
  static Error full() {
    return {.reason = Reason::storage,
            .message = "cannot write journal.v1: No space left on device",
            .remedy = "free space",
            .where = {.native_code = 28}};
  }
  void write(store::JournalLine line, Callback done) {
    if (frozen) return;
    if (slow) {
      held_.emplace_back(std::move(line), std::move(done));
      return;
    }
    if (failing) told_ = true;
    if (!failing && clock_ != nullptr) {
      const auto now = clock_->now().time_since_epoch();
      if (now - told_time_ >= std::chrono::seconds(1) || now < told_time_) {
        told_time_ = now;
        text += store::encode_line(++number_, store::TimeLine{.at = now, .boot = "boot", .uptime = now});
      }
    }
    if (!failing) text += store::encode_line(++number_, line);
    if (!done) return;
    post(executor_, [done = std::move(done), result = failing ? Result<void>(fail(full())) : Result<void>()] {
      done(result);
    });
  }

  Executor executor_;
  Clock* clock_;
  JournalContent loaded_;
  std::uint64_t number_ = 0;
  bool told_ = false;
  Duration told_time_{};
  std::vector<std::pair<store::JournalLine, Callback>> held_;
};

}  // namespace axisd::test
