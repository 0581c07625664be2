// The person at the machine.
#pragma once

#include <chrono>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "api/axisctl/commission/record.pb.h"
#include "api/axisctl/interrupt.hpp"

namespace axisd::axisctl::commission {

/// Ends the commissioning at once: Ctrl-C, or "abort" as an answer.
class Ended : public std::runtime_error {
 public:
  Ended(bool by_signal, const std::string& why) : std::runtime_error(why), by_signal_(by_signal) {}
  [[nodiscard]] bool by_signal() const { return by_signal_; }

 private:
  bool by_signal_;
};

/// Tells and asks. Nobody there (no terminal, end of input) is told apart from an empty answer, and never
/// means yes. Thread: one.
class Operator {
 public:
  Operator() = default;
  Operator(const Operator&) = delete;
  Operator& operator=(const Operator&) = delete;
  virtual ~Operator() = default;

  virtual void tell(std::string_view text) = 0;  ///< a line
  /// Asks, and waits for a line. What was typed before the question is no answer to it. Throws Ended.
  virtual std::optional<std::string> ask(std::string_view question) = 0;
  /// Waits for a line for so long. The end of the input is an empty line. Throws Ended.
  virtual std::optional<std::string> line_within(std::chrono::milliseconds limit) = 0;
  [[nodiscard]] virtual bool present() const = 0;
};

/// At the terminal of this program.
class TerminalOperator : public Operator {
 public:
  /// Writes to the descriptor `output`.
  TerminalOperator(const Interrupt& interrupt, int output);
  void tell(std::string_view text) override;
  std::optional<std::string> ask(std::string_view question) override;
  std::optional<std::string> line_within(std::chrono::milliseconds limit) override;
  [[nodiscard]] bool present() const override { return present_; }

 private:
  void write(std::string_view text) const;
  /// The next line, if there is one within the limit. At the end of the input nobody is present any more.
  std::optional<std::string> read_line(std::chrono::milliseconds limit);

  const Interrupt& interrupt_;
  int output_;
  bool present_;
};

/// A question that is answered by a word, and what was answered.
class Dialogue {
 public:
  explicit Dialogue(Operator& somebody) : operator_(somebody) {}

  struct Permission {
    bool granted = false;
    std::string reason;  ///< why not
  };
  /// May this be done now? Only "yes" is yes. Throws Ended for "abort".
  Permission permit(std::string_view question, Step& step);
  /// One of `words`, by its first letter or whole; nothing, if nobody is there. Throws Ended for "abort".
  std::optional<std::string> choose(std::string_view question, const std::vector<std::string>& words,
                                    Step& step);

  Operator& person() { return operator_; }

 private:
  Operator& operator_;
};

}  // namespace axisd::axisctl::commission
