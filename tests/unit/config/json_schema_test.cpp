// Asks an independent validator (python3-jsonschema) what it makes of the schema and the files.
#include <gmock/gmock.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "tests/unit/config/support.hpp"

namespace axisd::config {
namespace {

TEST(JsonSchema, AgreesWithTheLoader) {
  const auto path =
      std::filesystem::path(::testing::TempDir()) / ("axisd-schema-" + std::to_string(::getpid()) + ".json");
  std::ofstream(path) << json_schema();
  const auto command = "/usr/bin/python3 -B '" +
                       source_path("tests/unit/config/validate_schema.py").string() + "' '" + path.string() +
                       "' '" + source_path("").string() + "'";
  EXPECT_EQ(std::system(command.c_str()), 0) << command;
  std::filesystem::remove(path);
}

/// What a device of 32 bit can hold, with all digits.
TEST(JsonSchema, BoundsAreExact) {
  EXPECT_THAT(json_schema(), testing::HasSubstr(R"("minimum": -2147483648,)"));
  EXPECT_THAT(json_schema(), testing::HasSubstr(R"("maximum": 4294967295,)"));
}

TEST(JsonSchema, IsTheSameEveryTime) { EXPECT_EQ(json_schema(), json_schema()); }

}  // namespace
}  // namespace axisd::config
