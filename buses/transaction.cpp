#include "buses/transaction.hpp"

#include <array>
#include <utility>

namespace axisd {

std::string_view to_string(TransactionClass transaction_class) {
  static constexpr std::array<std::string_view, transaction_class_count> names = {
      "stop", "motion", "moving_state", "idle_state", "parameters", "scan"};
  return names.at(std::to_underlying(transaction_class));
}

}  // namespace axisd
