// Doing something at several machines of a cell at once.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "api/axisctl/cell_view.hpp"
#include "api/axisctl/invocation.hpp"

namespace axisd::axisctl {

/// Runs `work` once for each machine that the names are of, with their indices; at once, where there are
/// several, so that none waits for the time limit of another. Returns when all are done; throws what the
/// first one threw.
void for_each_machine(const std::vector<std::string>& names,
                      const std::function<void(const std::vector<std::size_t>&)>& work);

/// What the words behind a command select of a cell: "press-2" and "press-2/*" a whole machine,
/// "press-2/feeder" an axis; none: everything. Pure.
class Selection {
 public:
  /// Throws Failure (usage) where a word is none of these.
  explicit Selection(const std::vector<std::string>& words);
  /// All machines: those that come later, too.
  [[nodiscard]] bool everything() const { return axes_.empty(); }
  [[nodiscard]] bool has(const std::string& machine) const { return everything() || axes_.contains(machine); }
  /// Names of machines, in their order.
  [[nodiscard]] std::vector<std::string> machines() const;
  /// Names of axes, with the machine; empty: all of it.
  [[nodiscard]] std::vector<std::string> axes_of(const std::string& machine) const;

 private:
  std::map<std::string, std::vector<std::string>> axes_;
};

/// Throws Failure.
[[nodiscard]] Machines machines_of_cell(Invocation& invocation);
/// Those selected; of everything those that are not gone. Throws Failure (usage) where the cell has no such
/// machine.
[[nodiscard]] std::vector<std::string> selected(const Machines& known, const Selection& selection);
/// Tells on standard error which machines selected() leaves out, if any.
void tell_left_out(const Machines& known, const Selection& selection);

/// What became of a question to one machine.
template <class Response>
struct Answer {
  std::string machine;
  std::optional<Response> response;
  std::optional<Failure> failure;
};

/// Asks each of them, at once. `request(machine)`: what.
template <class Response, class Stub, class Request>
std::vector<Answer<Response>> ask_machines(const Client& client, const std::vector<std::string>& machines,
                                           grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&,
                                                                        Response*),
                                           const Request& request, std::chrono::nanoseconds limit) {
  std::vector<Answer<Response>> answers(machines.size());
  std::vector<std::string> names;
  names.reserve(machines.size());
  for (const auto& machine : machines) names.push_back(machine + "/");
  for_each_machine(names, [&](const std::vector<std::size_t>& indices) {
    for (const auto i : indices) {
      answers[i].machine = machines[i];
      try {
        answers[i].response = client.at(machines[i]).call_within(limit, method, request, machines[i]);
      } catch (const Failure& failure) {
        answers[i].failure = failure;
      }
    }
  });
  return answers;
}

/// Complains about those that did not answer; the exit status tells of them.
template <class Response>
void tell_failures(Invocation& invocation, const std::vector<Answer<Response>>& answers) {
  for (const auto& answer : answers) {
    if (!answer.failure) continue;
    complain(*answer.failure, invocation.json);
    invocation.status = answer.failure->code();
  }
}

}  // namespace axisd::axisctl
