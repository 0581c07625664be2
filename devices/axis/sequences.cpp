#include "devices/axis/sequences.hpp"

#include <fmt/format.h>

#include <utility>

namespace axisd {

void Sequences::launch(Task<> sequence, const char* name) {
  ++running_;
  auto counted = [](Task<> inner, int& count) -> Task<> {
    co_await std::move(inner);
    --count;
  };
  spawn(context_.env.executor, counted(std::move(sequence), running_),
        fmt::format("{} {}", context_.settings.name, name));
}

}  // namespace axisd
