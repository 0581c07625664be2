#include "api/axisctl/across.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <mutex>
#include <ranges>
#include <thread>

#include "api/axisctl/machine_names.hpp"
#include "axisd/cell/v1/cell_service.grpc.pb.h"
#include "config/text.hpp"

namespace axisd::axisctl {
namespace {

/// Whoever names a machine is told that it does not answer; of all machines nobody waits for those that left.
bool is_left_out(const cell::v1::Machine& machine, const Selection& selection) {
  return selection.everything() && machine.state() == cell::v1::MACHINE_STATE_GONE;
}

}  // namespace

void for_each_machine(const std::vector<std::string>& names,
                      const std::function<void(const std::vector<std::size_t>&)>& work) {
  std::map<std::string_view, std::vector<std::size_t>> parts;
  for (std::size_t i = 0; i < names.size(); ++i) parts[machine_in(names[i])].push_back(i);
  if (parts.size() == 1) return work(parts.begin()->second);
  std::mutex mutex;
  std::exception_ptr first;
  {
    std::vector<std::jthread> threads;
    for (const auto& indices : std::views::values(parts))
      threads.emplace_back([&] {
        try {
          work(indices);
        } catch (...) {
          const std::lock_guard lock(mutex);
          if (!first) first = std::current_exception();
        }
      });
  }
  if (first) std::rethrow_exception(first);
}

Selection::Selection(const std::vector<std::string>& words) {
  for (const auto& word : words) {
    const std::string machine(word.contains('/') ? machine_in(word) : word);
    const auto axis = word.contains('/') ? without_machine(word) : std::string_view("*");
    check_machine_name(machine);
    if (axis.empty())
      throw Failure(ExitCode::usage,
                    fmt::format("'{}' names nothing; write {} for the whole machine", word, machine));
    const bool new_one = !axes_.contains(machine);
    auto& axes = axes_[machine];
    if (axis == "*")
      axes.clear();
    else if (new_one || !axes.empty())  // all of it was asked for already
      axes.push_back(word);
  }
}

std::vector<std::string> Selection::machines() const {
  const auto names = std::views::keys(axes_);
  return {names.begin(), names.end()};
}

std::vector<std::string> Selection::axes_of(const std::string& machine) const {
  const auto found = axes_.find(machine);
  return found == axes_.end() ? std::vector<std::string>() : found->second;
}

Machines machines_of_cell(Invocation& invocation) {
  const auto response = invocation.client().call(&cell::v1::CellService::Stub::ListMachines,
                                                 cell::v1::ListMachinesRequest(), "");
  Machines machines;
  for (const auto& machine : response.machines()) machines.emplace(machine.name(), machine);
  return machines;
}

std::vector<std::string> selected(const Machines& known, const Selection& selection) {
  const auto keys = std::views::keys(known);
  const std::vector<std::string> names(keys.begin(), keys.end());
  for (const auto& name : selection.machines())
    if (!known.contains(name))
      throw Failure(ExitCode::usage,
                    fmt::format("the cell has no machine {}; {}", config::quoted(name),
                                did_you_mean(name, names, "'axisctl machines' shows those that it has")));
  std::vector<std::string> machines;
  for (const auto& [name, machine] : known)
    if (selection.has(name) && !is_left_out(machine, selection)) machines.push_back(name);
  return machines;
}

void tell_left_out(const Machines& known, const Selection& selection) {
  std::vector<std::string_view> names;
  for (const auto& [name, machine] : known)
    if (is_left_out(machine, selection)) names.push_back(name);
  if (!names.empty())
    fmt::print(
        stderr,
        "axisctl: left out, as gone: {}; neither registered nor answering, 'axisctl machines' tells since "
        "when\n",
        fmt::join(names, ", "));
}

}  // namespace axisd::axisctl
