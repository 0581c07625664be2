#include "buses/budget.hpp"

#include <fmt/format.h>

namespace axisd {

std::string bound_text(Duration bound) {
  if (bound == Duration::max()) return "any time";
  return fmt::format("{:.1f} ms", std::chrono::duration<double, std::milli>(bound).count());
}

}  // namespace axisd
