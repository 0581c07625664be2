#include "buses/budget.hpp"

#include <fmt/format.h>

namespace axisd {

std::string within_text(Duration bound) {
  return bound == Duration::max() ? "without bound" : "within " + bound_text(bound);
}

std::string bound_text(Duration bound) {
  if (bound == Duration::max()) return "any time";
  return fmt::format("{:.1f} ms", std::chrono::duration<double, std::milli>(bound).count());
}

}  // namespace axisd
