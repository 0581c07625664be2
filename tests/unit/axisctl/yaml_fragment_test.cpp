#include "api/axisctl/yaml_fragment.hpp"

#include <gmock/gmock.h>

#include "config/configuration.hpp"
#include "devices/descriptor.hpp"
#include "tests/support/source_tree.hpp"

namespace axisd::axisctl {
namespace {

using testing::HasSubstr;
using testing::Not;

v1::FoundNode found(std::uint32_t node, const std::string& model, std::uint32_t baud = 115200,
                    std::uint32_t pulses = 10000) {
  v1::FoundNode result;
  result.set_node(node);
  result.set_baud(baud);
  result.set_format("8N1");
  result.set_model(model);
  result.set_pulses_per_revolution(pulses);
  return result;
}

const FragmentContext context{.bus = "line-a", .baud = 115200, .taken = {"feeder", "axis-4"}};

/// A whole file with the fragment as its axes.
config::LoadResult load(const std::string& fragment,
                        const std::string& bus = "modbus_rtu: { port: sim, baud: 115200 }") {
  return config::load_text("machine: press-1\nbuses:\n  line-a:\n    " + bus + "\naxes:\n" + fragment,
                           "scanned.yaml");
}

TEST(YamlFragment, LoadsAsItIs) {
  const auto fragment = yaml_fragment({found(3, "ykd2405pr"), found(4, "ykd2405pr", 115200, 200)}, context);
  const auto result = load(fragment);
  for (const auto& diagnostic : result.diagnostics)
    ADD_FAILURE() << to_string(diagnostic) << "\n" << fragment;
  ASSERT_TRUE(result.configuration);
  ASSERT_EQ(result.configuration->axes.size(), 2U);
  const auto& first = result.configuration->axes[0].axis;
  EXPECT_EQ(first.name, "axis-3");
  EXPECT_EQ(first.bus, "line-a");
  EXPECT_EQ(first.node, 3);
  EXPECT_EQ(first.model, "ykd2405pr");
  EXPECT_EQ(first.limits.velocity, 1);
  EXPECT_EQ(result.configuration->axes[1].axis.name, "line-a-axis-4");  // the other name is taken
}

TEST(YamlFragment, LoadsForEveryModelAndMicrostep) {
  for (const auto* model : drive_models())
    for (const auto pulses : model->capabilities.pulses_per_revolution) {
      const bool can = model->bus == BusKind::canopen;
      auto there = context;
      there.baud = can ? 1'000'000 : 115'200;
      const auto fragment = yaml_fragment(
          {found(1, std::string(model->model), there.baud, static_cast<std::uint32_t>(pulses))}, there);
      const auto result = can ? load(fragment, "canopen: { interface: sim }") : load(fragment);
      EXPECT_TRUE(result.configuration) << fragment << to_string(result.diagnostics.at(0));
    }
}

TEST(YamlFragment, ANodeOfACanNetworkHasNoFormat) {
  auto node = found(5, "yss-c", 500'000, 0);
  node.clear_format();
  EXPECT_EQ(yaml_fragment({node}, {.bus = "can0", .baud = 500'000}),
            "  # node 5 (yss-c, 500000 bit/s): its microstep could not be read, scan again\n");
}

TEST(YamlFragment, ADriveByCia402NeedsItsDataSheet) {
  auto node = found(7, "cia402", 1'000'000, 0);
  node.clear_format();
  node.set_device_type(0x00020192);
  node.set_vendor(0x0A5A);
  node.set_product(0x00402001);
  node.set_note("Standard servo 402");
  auto fragment = yaml_fragment({node}, {.bus = "line-a", .baud = 1'000'000});
  EXPECT_THAT(fragment,
              HasSubstr("  axis-7:   # Standard servo 402, vendor 0x00000A5A, product 0x00402001\n"));
  EXPECT_THAT(fragment, HasSubstr("    model: cia402\n"));
  const auto fill_in = [&fragment](const std::string& placeholder, const std::string& value) {
    const auto at = fragment.find(placeholder);
    ASSERT_NE(at, std::string::npos) << fragment;
    fragment.replace(at, placeholder.size(), value);
  };
  fill_in("axis-7.eds", test::in_source_tree("config/examples/standard-drive.eds"));
  const auto untold = load(fragment, "canopen: { interface: sim }");
  ASSERT_FALSE(untold.configuration) << "no unit may be guessed";
  EXPECT_THAT(to_string(untold.diagnostics.at(0)), HasSubstr("drive: { velocity_unit: UNIT }"));
  fill_in("# velocity_unit: UNIT", "velocity_unit: pulses_per_second");
  const auto result = load(fragment, "canopen: { interface: sim }");
  EXPECT_TRUE(result.configuration) << fragment << to_string(result.diagnostics.at(0));
}

TEST(YamlFragment, LeavesOutWhatIsConfiguredOrUnknown) {
  auto known = found(3, "ykd2405pr");
  known.set_configured_as("feeder");
  EXPECT_EQ(yaml_fragment({known, found(9, "")}, context), "");
}

TEST(YamlFragment, NamesInCommentsWhatCannotBeAnAxisYet) {
  const auto fragment = yaml_fragment({found(3, "ykd2405pr"), found(3, "ykd2405pr"),
                                       found(5, "ykd2405pr", 9600), found(6, "ykd2405pr", 115200, 0)},
                                      context);
  EXPECT_THAT(fragment,
              HasSubstr("# node 3 (ykd2405pr, 115200 bit/s, 8N1): a second drive with this address"));
  EXPECT_THAT(fragment,
              HasSubstr("# node 5 (ykd2405pr, 9600 bit/s, 8N1): set its switches to the bus's 115200"));
  EXPECT_THAT(fragment,
              HasSubstr("# node 6 (ykd2405pr, 115200 bit/s, 8N1): its microstep could not be read"));
  EXPECT_THAT(fragment, Not(HasSubstr("axis-5")));
  const auto result = load(fragment);
  ASSERT_TRUE(result.configuration);
  EXPECT_EQ(result.configuration->axes.size(), 1U);
}

}  // namespace
}  // namespace axisd::axisctl
