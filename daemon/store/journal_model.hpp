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
  void apply(const JournalLine& line, TimePoint now);
  /// Forgets what has ended, was not heard of since `then`, and nobody has to reset any more.
  void forget_before(TimePoint then);

  void doubt_is_over() { doubt_.reset(); }

  /// The shortest journal that says the same.
  [[nodiscard]] std::vector<JournalLine> lines() const;
  [[nodiscard]] JournalContent content() const;
  [[nodiscard]] std::size_t size() const { return entries_.size(); }

 private:
  struct Entry {
    JournalledCommand command;
    TimePoint touched{};
  };
  Entry& entry_of(const Command& command, TimePoint now);
  void apply_line(const AcceptedLine& line, TimePoint now);
  void apply_line(const AttachedLine& line, TimePoint now);
  void apply_line(const SendingLine& line, TimePoint now);
  void apply_line(const EndedLine& line, TimePoint now);
  void apply_line(const DoubtLine& line, TimePoint now);
  [[nodiscard]] bool awaits_reset(const Command& command) const;

  std::list<Entry> entries_;  ///< in order of acceptance
  std::unordered_map<std::string, std::list<Entry>::iterator> by_id_;
  std::map<std::string, std::string> unknown_outcomes_;  ///< axis -> id
  std::optional<DoubtLine> doubt_;
};

/// What a whole file says.
struct JournalLoad {
  JournalModel model;
  std::string damage{};  ///< what was wrong with it; empty: nothing
  /// Bytes of a last line that was never written whole, and so never made durable: nothing was sent for it.
  /// Left out, and no damage.
  std::size_t torn = 0;
  bool newer_format = false;  ///< intact as far as can be told, but not to be read by this build
};
JournalLoad load_journal(std::string_view text, TimePoint now);

}  // namespace axisd::store
