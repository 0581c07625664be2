// What rtnetlink says of network interfaces.
#include "buses/can/link_report.hpp"
#include "tests/fuzz/target.hpp"

namespace axisd::fuzz {

void run(Input input) {
  const auto bytes = input.rest();
  for (const auto& report : can::parse_link_reports(std::as_bytes(bytes)))
    expect(report.name.size() <= bytes.size() && !report.name.contains('\0'), "a name is of these bytes");
}

}  // namespace axisd::fuzz
