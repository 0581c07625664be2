#include "devices/cia402/common_start.hpp"

#include <utility>

namespace axisd::cia402 {

void CommonStart::refuse(std::string why) {
  state_ = State::absent;
  pdo_.reset();
  note_ = std::move(why);
}

void CommonStart::configure(std::uint32_t pdo) {
  state_ = State::unproven;
  pdo_ = pdo;
  note_ = "not proven yet";
}

void CommonStart::forget() {
  if (state_ != State::disproven) state_ = State::absent;
  pdo_.reset();
  note_ = "it is not configured yet";
}

void CommonStart::note_obstacle(const std::string& why) {
  if (state_ == State::unproven) note_ = "not proven yet: " + why;
}

void CommonStart::judge(std::string differs) {
  if (state_ != State::unproven) return;
  state_ = differs.empty() ? State::proven : State::disproven;
  if (state_ == State::disproven) pdo_.reset();
  note_ = std::move(differs);
}

}  // namespace axisd::cia402
