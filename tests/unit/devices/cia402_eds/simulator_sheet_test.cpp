// A simulated drive is what its data sheet says: the example's, and the example with parts taken out.
#include <fmt/format.h>

#include <fstream>
#include <memory>
#include <sstream>

#include "buses/canopen/eds.hpp"
#include "devices/cia402_eds/simulator_dictionary.hpp"
#include "tests/support/source_tree.hpp"
#include "tests/unit/devices/cia402_eds/standard_drive_bench.hpp"

namespace axisd::cia402_eds {
namespace {

constexpr std::uint32_t no_object = 0x06020000, bad_value = 0x06090030, read_only = 0x06010002;

std::string example() {
  std::ifstream file(test::in_source_tree("config/examples/standard-drive.eds"));
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

/// A section that is no object any more.
void take_out(std::string& text, const std::string& section) {
  const auto at = text.find("\n[" + section + "]");
  ASSERT_NE(at, std::string::npos) << section;
  text.replace(at, section.size() + 3, "\n[Unused" + section + "]");
}

/// Replaces what stands behind the first `key` of a section.
void change(std::string& text, const std::string& section, const std::string& key, const std::string& value) {
  auto at = text.find("\n[" + section + "]");
  ASSERT_NE(at, std::string::npos) << section;
  at = text.find("\n" + key + "=", at);
  ASSERT_NE(at, std::string::npos) << key;
  const auto from = at + key.size() + 2;
  text.replace(from, text.find('\n', from) - from, value);
}

simulation::SimulatedNodeSettings made_of(const std::string& text) {
  auto sheet = canopen::parse_eds(text);
  if (!sheet) throw std::runtime_error(sheet.error().front().message);
  return {.sheet = std::make_shared<const canopen::Eds>(std::move(*sheet))};
}

TEST(SimulatedSheet, MakesTheDriveThatTheExampleDescribes) {
  const auto settings = made_of(example());
  simulation::CanopenDictionary own, of_sheet;
  add_rows(own);
  add_rows_of_sheet(of_sheet, settings);
  for (const auto& [object, entry] : settings.sheet->objects) {
    SCOPED_TRACE(to_string(object));
    const auto* row = of_sheet.find(object.index, object.sub);
    ASSERT_NE(row, nullptr);
    const auto* expected = own.find(object.index, object.sub);
    if (expected == nullptr) continue;  // eds_drive_test.cpp
    EXPECT_EQ(row->text, expected->text);
    if (!row->text.empty()) continue;
    EXPECT_EQ(row->size, expected->size);
    EXPECT_EQ(row->is_signed, expected->is_signed);
    EXPECT_EQ(row->access == Access::ro, expected->access == Access::ro);
    if (object.index < 0x6000) continue;
    EXPECT_EQ(row->mappable, expected->mappable);
    EXPECT_EQ(row->default_value, expected->default_value);
  }
  const auto pdos = pdo_settings_of(*settings.sheet);
  EXPECT_EQ(pdos.rpdos, 4);
  EXPECT_EQ(pdos.tpdos, 4);
}

TEST(SimulatedSheet, TellsIdentityAndLimits) {
  auto text = example();
  change(text, "1018sub2", "DefaultValue", "0x1234");
  change(text, "6081", "HighLimit", "5000");
  change(text, "6081", "DefaultValue", "700\nParameterValue=800");
  change(text, "6085", "AccessType", "ro");
  Bench bench(made_of(text));
  EXPECT_EQ(bench.read(0x1018, 1), 0x0A5A);
  EXPECT_EQ(bench.read(0x1018, 2), 0x1234);
  EXPECT_EQ(bench.read_text(0x1008), "Standard servo 402");
  EXPECT_EQ(bench.read(0x6081), 800) << "as it is configured";
  EXPECT_EQ(bench.write(0x6081, 4, 5001), bad_value);
  EXPECT_EQ(bench.write(0x6081, 4, 5000), 0U);
  EXPECT_EQ(bench.write(0x6085, 4, 5000), read_only);
}

TEST(SimulatedSheet, BrakesWithTheAccelerationWhereItHasNoOther) {
  auto text = example();
  take_out(text, "6084");
  Bench bench(made_of(text));
  EXPECT_EQ(bench.write(0x6084, 4, 1), no_object);
  EXPECT_EQ(bench.write(0x6083, 4, 50'000), 0U);
  bench.enable(1);
  bench.move(100'000);
  bench.run(1s);
  const auto before = bench.position();
  bench.control(0x11F);
  bench.run(1s);
  EXPECT_NEAR(bench.position() - before, 1'000, 10)
      << "10,000 inc/s with 50,000 inc/s^2, within a millisecond";
}

/// As files have it of drives that nobody has set up.
TEST(SimulatedSheet, AWindowOf0InTheFileIsLeftOpen) {
  auto text = example();
  change(text, "6065", "DefaultValue", "0");
  change(text, "6067", "DefaultValue", "0");
  auto settings = made_of(text);
  settings.encoder = {.noise = 1, .following = 3ms};
  Bench bench(settings);
  bench.enable(1);
  bench.move(10'000);
  bench.run(3s);
  EXPECT_EQ(bench.status() & 0x6FU, 0x27U) << "no following error";
  EXPECT_NEAR(bench.position(), 10'000, 1);
  EXPECT_TRUE(bench.bit(10));
  EXPECT_EQ(bench.write(0x6067, 4, 0), 0U) << "it can be set to 0 all the same";
  EXPECT_EQ(bench.read(0x6067), 0);
}

TEST(SimulatedSheet, HasSwitchesThatItDoesNotShow) {
  auto text = example();
  take_out(text, "60FD");
  Bench bench(made_of(text));
  bench.enable(1);
  bench.move(100'000);
  bench.run(500ms);
  bench.drive().set_input("POS", true);
  bench.run(1s);
  EXPECT_EQ(bench.velocity(), 0);
  EXPECT_TRUE(bench.bit(11));
  EXPECT_EQ(bench.write(0x60FD, 4, 0), no_object);
}

TEST(SimulatedSheet, RefusesModesThatItDoesNotHave) {
  auto text = example();
  take_out(text, "6098");
  Bench without_method(made_of(text));
  EXPECT_EQ(without_method.write(0x6060, 1, 6), bad_value);
  EXPECT_EQ(without_method.write(0x6060, 1, 3), 0U);
  text = example();
  change(text, "6502", "DefaultValue", "0x21");
  Bench without_velocity(made_of(text));
  EXPECT_EQ(without_velocity.write(0x6060, 1, 3), bad_value);
  EXPECT_EQ(without_velocity.write(0x6060, 1, 6), 0U);
}

TEST(SimulatedSheet, BeginsInTheModeOfTheFile) {
  auto text = example();
  change(text, "6060", "DefaultValue", "3");
  Bench bench(made_of(text));
  EXPECT_EQ(bench.read(0x6061), 3);
  bench.drive().set_power(false);
  bench.run(100ms);
  bench.drive().set_power(true);
  bench.run(1s);
  EXPECT_EQ(bench.read(0x6061), 3);
}

TEST(SimulatedSheet, HasThePdosOfTheFile) {
  auto text = example();
  for (const auto* sub : {"", "sub0", "sub1", "sub2", "sub3", "sub4", "sub5"})
    take_out(text, std::string("1403") + sub);
  change(text, "1A00sub0", "AccessType", "ro");
  change(text, "1800sub1", "DefaultValue", "0x180");
  change(text, "1801sub1", "DefaultValue", "0x180");
  Bench bench(made_of(text));
  EXPECT_EQ(bench.write(0x1403, 1, 4, 0x501), no_object);
  EXPECT_EQ(bench.write(0x1A00, 0, 1, 0), read_only);
  EXPECT_EQ(bench.read(0x1400, 1), 0x201);
  EXPECT_EQ(bench.read(0x1800, 1), 0x181) << "the base alone means the node's";
  EXPECT_EQ(bench.read(0x1801, 1), 0x180) << "that of another PDO means itself";
  EXPECT_EQ(bench.read(0x1A00), 1);
  bench.put(0x000, {0x01, 0x01});
  EXPECT_FALSE(bench.run(5ms).empty()) << "6041h, by event";
}

/// A flawed file: a mapping whose PDO has no identifier.
TEST(SimulatedSheet, APdoWithoutIdentifierIsNone) {
  auto text = example();
  take_out(text, "1801sub1");
  change(text, "1A01sub0", "DefaultValue", "1");
  change(text, "1A01sub1", "DefaultValue", "0x60640020");
  Bench bench(made_of(text));
  bench.put(0x000, {0x01, 0x01});
  for (const auto& frame : bench.run(100ms)) EXPECT_NE(frame.id, 0U) << "that is NMT";
}

TEST(SimulatedSheet, CountsItsErrors) {
  Bench bench(made_of(example()));
  EXPECT_EQ(bench.read(0x1003), 0);
  bench.drive().raise_alarm(0x2310);
  EXPECT_EQ(bench.read(0x1003), 1);
  EXPECT_EQ(bench.read(0x1003, 1), 0x2310);
}

/// One entry more than there can be.
TEST(SimulatedSheet, HasAtMost254Errors) {
  auto text = example();
  for (int sub = 5; sub <= 255; ++sub)
    text += fmt::format(
        "\n[1003sub{:X}]\nParameterName=Error\nObjectType=0x7\nDataType=0x0007\nAccessType=ro\n", sub);
  Bench bench(made_of(text));
  for (int i = 0; i < 300; ++i) {
    bench.drive().raise_alarm(0x2310);
    bench.control(0x00);
    bench.control(0x80);
  }
  EXPECT_EQ(bench.read(0x1003), 254);
}

}  // namespace
}  // namespace axisd::cia402_eds
