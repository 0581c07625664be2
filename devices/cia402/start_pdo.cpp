#include "devices/cia402/start_pdo.hpp"

#include <utility>

namespace axisd::cia402 {

void StartPdo::refuse(std::string why) {
  state_ = State::absent;
  id_.reset();
  note_ = std::move(why);
}

void StartPdo::configure(std::uint32_t id) {
  state_ = State::unproven;
  id_ = id;
  note_ = "not proven yet";
}

void StartPdo::forget() {
  if (state_ != State::disproven) state_ = State::absent;
  id_.reset();
  note_ = "it is not configured yet";
}

void StartPdo::note_obstacle(const std::string& why) {
  if (state_ == State::unproven) note_ = "not proven yet: " + why;
}

void StartPdo::judge(std::string differs) {
  if (state_ != State::unproven) return;
  state_ = differs.empty() ? State::proven : State::disproven;
  if (state_ == State::disproven) id_.reset();
  note_ = std::move(differs);
}

}  // namespace axisd::cia402
