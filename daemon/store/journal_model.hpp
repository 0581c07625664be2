// What the lines of the command journal say, and which of them are still needed: pure.
#pragma once

#include <list>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "buses/clock.hpp"
#include "daemon/store/journal_text.hpp"

namespace axisd::store {

class JournalModel {
 public:
  /// Commands of which no more than their ids needs to be kept.
  struct Settled {
    std::vector<std::string> commands;  ///< their own ids
    std::vector<ClientRun> runs;
  };

  void apply(const JournalLine& line);
  /// What time it is now, that long after a start of the computer: the journal's time goes on with it. Over a
  /// restart of the computer it stands still, as nothing tells how long that took: what is remembered is
  /// remembered longer, never shorter.
  [[nodiscard]] TimeLine time_after(const std::string& boot, Duration uptime) const;
  /// The latest that is known.
  [[nodiscard]] Duration now() const { return latest_; }
  /// Forgets what has ended, was not heard of since `then`, and nobody has to reset any more.
  void forget_before(Duration then);
  /// Of what has ended all but the newest ones, so many.
  [[nodiscard]] Settled settled(std::size_t kept) const;
  void drop(const std::vector<std::string>& commands);

  [[nodiscard]] const std::vector<IdsLine>& id_files() const { return id_files_; }
  void set_id_files(std::vector<IdsLine> files) { id_files_ = std::move(files); }

  void doubt_is_over() { doubt_.reset(); }

  /// What it last heard of the state file.
  [[nodiscard]] const std::optional<StateLine>& state() const { return state_; }

  /// The shortest journal that says the same.
  [[nodiscard]] std::vector<JournalLine> lines() const;
  /// Without what is in the files of ids.
  [[nodiscard]] JournalContent content() const;
  [[nodiscard]] std::size_t size() const { return entries_.size(); }

 private:
  struct Entry {
    JournalledCommand command;
    Duration touched{};
  };
  Entry& entry_of(const Command& command);
  void apply_line(const AcceptedLine& line);
  void apply_line(const AttachedLine& line);
  void apply_line(const SendingLine& line);
  void apply_line(const EndedLine& line);
  void apply_line(const DoubtLine& line);
  void apply_line(const TimeLine& line);
  void apply_line(const HeardLine& line);
  void apply_line(const IdsLine& line);
  void apply_line(const StateLine& line) { state_ = line; }
  [[nodiscard]] bool awaits_reset(const Command& command) const;

  Duration time_{};               ///< of what is applied
  Duration latest_{};             ///< that it ever was
  std::optional<TimeLine> mark_;  ///< the last one that names a start of the computer
  std::list<Entry> entries_;      ///< in order of acceptance
  std::unordered_map<std::string, std::list<Entry>::iterator> by_id_;
  std::map<std::string, std::string> unknown_outcomes_;  ///< axis -> id
  std::optional<DoubtLine> doubt_;
  std::optional<StateLine> state_;
  std::vector<IdsLine> id_files_;  ///< the oldest first
};

/// What a whole file says.
struct JournalLoad {
  JournalModel model;
  std::string damage{};  ///< what was wrong with it; empty: nothing
  /// Bytes of a last line that was never written whole, and so never made durable: nothing was sent for it.
  /// Left out, and no damage.
  std::size_t torn = 0;
  std::uint64_t last_number = 0;  ///< the highest of a line; 0: there is none
  bool newer_format = false;      ///< intact as far as can be told, but not to be read by this build
};
JournalLoad load_journal(std::string_view text);

}  // namespace axisd::store
