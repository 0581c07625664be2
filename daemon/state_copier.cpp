#include "daemon/state_copier.hpp"

#include <fmt/format.h>

#include <iostream>
#include <memory>
#include <string>
#include <utility>

#include "buses/regular_file.hpp"
#include "daemon/daemon.hpp"
#include "daemon/store/state_backup.hpp"

namespace axisd {

namespace {

/// That may wait for others.
constexpr std::size_t most_copies = 4;
constexpr std::size_t largest_backup = std::size_t{16} << 20U;

Result<StateCopy> copy(const std::filesystem::path& directory) {
  auto text = store::back_up_state(directory);
  if (!text) return fail(text.error());
  const auto generation = store::decode(*text);
  if (!generation) return fail(generation.error());
  return StateCopy{.text = *std::move(text), .generation = generation->number};
}

}  // namespace

StateCopier::StateCopier(std::filesystem::path directory)
    : directory_(std::move(directory)), worker_(most_copies) {}

void StateCopier::copy_state(std::function<void(Result<StateCopy>)> callback) {
  const auto shared = std::make_shared<std::function<void(Result<StateCopy>)>>(std::move(callback));
  const bool taken = worker_.post([this, shared] { (*shared)(copy(directory_)); });
  if (!taken)
    (*shared)(fail(Reason::busy, "several clients take a backup already", "repeat the call in a moment"));
}

int restore_state(const std::string& file, const std::filesystem::path& directory) {
  const auto text = read_regular_file(file, largest_backup);
  const auto restored =
      text ? store::restore_state(directory, *text) : Result<store::Generation>(fail(text.error()));
  if (!restored) {
    std::cerr << "axisd: " << to_string(restored.error()) << '\n';
    return text ? exit_status::failed : exit_status::configuration;
  }
  std::cout << fmt::format(
      "{}: restored as generation {}. Start axisd, look at the machine, then 'axisctl state accept': until "
      "then motion waits. StopAll is latched, commands are refused for 10 minutes (axisctl state), and "
      "positions have to be homed again\n",
      directory.string(), restored->number);
  return exit_status::in_order;
}

}  // namespace axisd
