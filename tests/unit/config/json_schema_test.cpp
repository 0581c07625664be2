// Asks an independent validator (python3-jsonschema) what it makes of the schema and the files.
#include <gtest/gtest.h>
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

TEST(JsonSchema, IsTheSameEveryTime) { EXPECT_EQ(json_schema(), json_schema()); }

}  // namespace
}  // namespace axisd::config
