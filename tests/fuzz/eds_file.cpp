// EDS and DCF files as makers ship them.
#include "buses/canopen/eds.hpp"
#include "tests/fuzz/target.hpp"

namespace axisd::fuzz {

void run(Input input) {
  const auto eds = canopen::parse_eds(text(input.rest()));
  if (eds)
    expect(eds->objects.size() <= canopen::eds_object_limit && eds->flaws.size() <= canopen::eds_flaw_limit,
           "a file has so many objects and flaws at most");
  else
    expect(!eds.error().empty() && eds.error().size() <= canopen::eds_problem_limit + 1,
           "what is refused is told, so much of it at most");
}

}  // namespace axisd::fuzz
