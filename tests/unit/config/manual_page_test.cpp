#include <gmock/gmock.h>

#include "config/configuration.hpp"
#include "config/roff.hpp"
#include "config/schema.hpp"
#include "devices/descriptor.hpp"

namespace axisd::config {
namespace {

using testing::HasSubstr;

/// Returns how many keys were looked for.
int expect_described(const std::string& page, std::span<const KeySpec> keys) {
  int count = 0;
  for (const auto& spec : keys) {
    EXPECT_THAT(page, HasSubstr(".TP\n\\fB" + roff(spec.key) + "\\fR: "));
    EXPECT_THAT(page, HasSubstr("\n" + roff(spec.description) + "\n")) << spec.key;
    count += 1 + expect_described(page, spec.children);
  }
  return count;
}

TEST(ManualPage, HasEachKeyAndEachModel) {
  const auto page = manual_page();
  EXPECT_GT(expect_described(page, schema()), 100);
  for (const auto* model : drive_models()) EXPECT_THAT(page, HasSubstr(".SS " + roff(model->model) + "\n"));
}

TEST(ManualPage, KeepsTextFromBeingTakenForRequests) {
  EXPECT_EQ(roff(".hidden\n'too \\n -1"), "\\&.hidden\n\\&'too \\en \\-1");
}

}  // namespace
}  // namespace axisd::config
