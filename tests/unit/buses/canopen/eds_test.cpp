#include "buses/canopen/eds.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <random>

#include "buses/canopen/eds_values.hpp"

namespace axisd::canopen {
namespace {

using testing::HasSubstr;

const std::string good = R"([FileInfo]
FileName=drive.eds
; a comment
[DeviceInfo]
VendorName=Example
VendorNumber=0x100
ProductName=Drive
ProductNumber=3
RevisionNumber=0x00010000

[MandatoryObjects]
SupportedObjects=2
1=0x1000
2=0x1018

[OptionalObjects]
SupportedObjects=2
1=0x1800
2=0x607a

[1000]
ParameterName=Device type
ObjectType=0x7
DataType=0x0007
AccessType=ro
DefaultValue=0x00040192
PDOMapping=0

[1018]
ParameterName=Identity
ObjectType=9
SubNumber=2

[1018sub0]
ParameterName=Number of entries
ObjectType=0x7
DataType=5
AccessType=const
DefaultValue=1

[1018Sub1]
ParameterName=Vendor
DataType=7
AccessType=RO

[1800]
ParameterName=TPDO 1
ObjectType=9
SubNumber=2

[1800sub0]
ParameterName=Number of entries
DataType=5
AccessType=ro
DefaultValue=1

[1800sub1]
ParameterName=COB-ID
DataType=7
AccessType=rw
DefaultValue=$NODEID+0x180

[607A]
ParameterName=Target position
DataType=4
AccessType=rww
LowLimit=-1000000
HighLimit=0x000F4240
DefaultValue=5000
PDOMapping=1

[2100]
ParameterName=Gains
ObjectType=8
DataType=6
AccessType=rw
CompactSubObj=3
DefaultValue=010

[2100Name]
NrOfEntries=1
2=Second

[2200]
ParameterName=Ratio
DataType=8
AccessType=rw
DefaultValue=1.5

[2201]
ParameterName=Name
DataType=9
AccessType=ro
DefaultValue=YSS-C
)";

TEST(Eds, ReadsObjects) {
  const auto eds = parse_eds(good);
  ASSERT_TRUE(eds) << eds.error().at(0).message;
  EXPECT_TRUE(eds->flaws.empty()) << eds->flaws.at(0).message;
  EXPECT_EQ(eds->vendor_name, "Example");
  EXPECT_EQ(eds->vendor, 0x100U);
  EXPECT_EQ(eds->product, 3U);
  EXPECT_EQ(eds->revision, 0x10000U);
  EXPECT_EQ(eds->find({0x1000, 0})->initial->value, 0x40192);
  EXPECT_EQ(eds->find({0x1018, 0})->access, Access::constant);
  EXPECT_EQ(eds->find({0x1018, 1})->name, "Vendor");
  EXPECT_EQ(eds->find({0x1800, 1})->initial->resolved(5), 0x185);
  const auto* target = eds->find({0x607A, 0});
  EXPECT_EQ(target->type, DataType::integer32);
  EXPECT_EQ(target->access, Access::read_write_output);
  EXPECT_TRUE(target->mappable);
  EXPECT_EQ(target->low->value, -1000000);
  EXPECT_EQ(target->high->value, 1000000);
  EXPECT_EQ(eds->find({0x2100, 0})->initial->value, 3);
  EXPECT_EQ(eds->find({0x2100, 2})->name, "Second");
  EXPECT_EQ(eds->find({0x2100, 3})->name, "Gains3");
  EXPECT_EQ(eds->find({0x2100, 3})->initial->value, 8);  // octal, as CiA 306 has it
  EXPECT_EQ(eds->find({0x2200, 0})->real_initial, 1.5);
  EXPECT_EQ(eds->find({0x2201, 0})->text_initial, "YSS-C");
  EXPECT_EQ(eds->find({0x2100, 4}), nullptr);
  EXPECT_EQ(eds->objects.size(), 12U);
}

TEST(Eds, DoesNotCareForLineEndsAndByteOrderMark) {
  std::string windows = "\xEF\xBB\xBF";
  for (const char letter : good) windows += letter == '\n' ? std::string("\r\n") : std::string(1, letter);
  const auto eds = parse_eds(windows);
  ASSERT_TRUE(eds) << eds.error().at(0).message;
  EXPECT_EQ(eds->objects.size(), 12U);
}

TEST(Eds, Numbers) {
  const auto number = [](const char* text, DataType type) { return parse_number(text, type); };
  EXPECT_EQ(number("0x80000000", DataType::integer32)->value, -2147483648LL);
  EXPECT_EQ(number("0xFF", DataType::integer8)->value, -1);
  EXPECT_EQ(number("-128", DataType::integer8)->value, -128);
  EXPECT_FALSE(number("-129", DataType::integer8));
  EXPECT_FALSE(number("256", DataType::unsigned8));
  EXPECT_FALSE(number("-1", DataType::unsigned8));
  EXPECT_FALSE(number("2", DataType::boolean));
  EXPECT_EQ(number("0xFFFFFFFFFFFFFFFF", DataType::unsigned64)->value, -1);  // wraps
  EXPECT_EQ(*parse_number(" $NodeId + 0x200 "), (EdsNumber{.value = 0x200, .plus_node_id = true}));
  EXPECT_EQ(*parse_number("0x80000200+$NODEID"), (EdsNumber{.value = 0x80000200, .plus_node_id = true}));
  EXPECT_EQ(parse_number("$NODEID")->resolved(127), 127);
  EXPECT_EQ(parse_number("$NODEID+0600")->value, 0600);  // octal
  EXPECT_EQ(*parse_number("384 + $NODEID"), (EdsNumber{.value = 384, .plus_node_id = true}));
  EXPECT_EQ(*parse_number("NodeID+0x80000000+0x180"), (EdsNumber{.value = 0x80000180, .plus_node_id = true}));
  EXPECT_EQ(parse_number("08")->value, 8) << "no octal number";
  for (const auto* bad :
       {"", "0x", "1 2", "$NODEID0x200", "$NODEID+", "$NODEID-1", "4x0", "$NODEID*2", "0x1g",
        "99999999999999999999", "1.5", "+-1", "$NODEID+$NODEID", "0xFFFFFFFF+1+$NODEID"})
    EXPECT_FALSE(parse_number(bad)) << bad;
}

TEST(Eds, IsBounded) {
  EXPECT_THAT(parse_eds(std::string(eds_size_limit + 1, ' ')).error().at(0).message, HasSubstr("at most"));
  EXPECT_THAT(parse_eds("").error().at(0).message, HasSubstr("no object"));
  EXPECT_THAT(parse_eds(std::string("[1000]\n\0", 8)).error().at(0).message, HasSubstr("not a text file"));
  EXPECT_THAT(parse_eds("[MandatoryObjects]\nSupportedObjects=65535\n").error().at(0).message,
              HasSubstr("no object"));
  EXPECT_THAT(parse_eds("\n<?xml version=\"1.0\"?>\n<ISO15745ProfileContainer>").error().at(0).message,
              HasSubstr("XML"));
  std::string many;
  for (std::size_t i = 0; i < eds_flaw_limit; ++i) many += "x\n";
  EXPECT_EQ(parse_eds(good + many)->flaws.size(), eds_flaw_limit);
  for (int i = 0; i < 3; ++i) many += many;
  EXPECT_THAT(parse_eds(good + many).error().at(0).message, HasSubstr("more than 10000 lines are wrong"));
}

TEST(Eds, ShowsNothingButPrintableCharacters) {
  // Latin-1, an escape sequence, and a line without end.
  const auto named = parse_eds("[2000]\nParameterName=Kr\xFCmmung \x1B[31m\nDataType=6\nAccessType=rw\n");
  ASSERT_TRUE(named);
  EXPECT_EQ(named->find({0x2000, 0})->name, "Kr?mmung ?[31m");
  const auto broken =
      parse_eds("[2000]\nParameterName=a\nDataType=\xFC\x1B" + std::string(5000, '9') + "\nAccessType=rw\n");
  ASSERT_TRUE(broken);
  EXPECT_EQ(broken->flaws.at(0).line, 3);
  EXPECT_EQ(broken->flaws.at(0).message.find("datatype=??999"), 0U);
  EXPECT_LT(broken->flaws.at(0).message.size(), 300U);
}

/// Broken in any way, a file is read or refused with a reason.
TEST(Eds, SurvivesMutations) {
  std::mt19937 random(3);
  const std::string letters = "[]=;#\n\r\t$0x9fFsub+- \x80\xFF";
  for (int run = 0; run < 1500; ++run) {
    auto text = good;
    for (unsigned i = 0; i < 1 + random() % 12; ++i) {
      const auto at = random() % text.size();
      switch (random() % 4) {
        case 0:
          text[at] = letters[random() % letters.size()];
          break;
        case 1:
          text.erase(at, random() % 40);
          break;
        case 2:
          text.insert(at, text.substr(random() % text.size(), random() % 60));
          break;
        default:
          text.resize(std::max<std::size_t>(at, 1));
      }
      if (text.empty()) text = "[";
    }
    const auto eds = parse_eds(text);
    if (!eds) {
      ASSERT_FALSE(eds.error().empty());
      ASSERT_FALSE(eds.error().at(0).message.empty());
    }
  }
}

TEST(Eds, LoadsAFileAndNamesItInErrors) {
  const auto folder = std::filesystem::temp_directory_path() / ("axisd-eds-" + std::to_string(getpid()));
  std::filesystem::create_directory(folder);
  const auto path = (folder / "drive.eds").string();
  std::ofstream(path) << good;
  EXPECT_TRUE(load_eds(path));
  std::ofstream(path) << "<xml/>";
  const auto broken = load_eds(path);
  EXPECT_EQ(broken.error().reason, Reason::invalid_argument);
  EXPECT_THAT(broken.error().message, HasSubstr(path + ": the file is XML"));
  EXPECT_THAT(broken.error().remedy, HasSubstr("EDS or DCF"));
  EXPECT_THAT(load_eds(folder.string()).error().message, HasSubstr("cannot be read"));
  std::filesystem::remove_all(folder);
  EXPECT_THAT(load_eds(path).error().message, HasSubstr("cannot be read"));
}

}  // namespace
}  // namespace axisd::canopen
