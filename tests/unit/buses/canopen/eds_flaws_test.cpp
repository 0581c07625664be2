// What makers' files have wrong: it is told with its line, and costs no more than what it says.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "buses/canopen/eds.hpp"
#include "buses/canopen/eds_values.hpp"

namespace axisd::canopen {
namespace {

using testing::HasSubstr;

const std::string good = R"([DeviceInfo]
VendorNumber=0x100
[MandatoryObjects]
SupportedObjects=2
1=0x1000
2=0x1018
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
DataType=5
AccessType=const
[1018sub1]
ParameterName=Vendor
DataType=7
AccessType=ro
DefaultValue=0x100
[6081]
ParameterName=Profile velocity
DataType=7
AccessType=rww
LowLimit=1
HighLimit=100000
DefaultValue=5000
PDOMapping=1
)";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

Eds read(const std::string& text) {
  auto eds = parse_eds(text);
  EXPECT_TRUE(eds) << eds.error().at(0).message << "\n" << text;
  return eds ? *eds : Eds{};
}

/// The file with an object that is described by these lines.
Eds with(const std::string& lines) { return read(good + "[2000]\n" + lines); }

constexpr Object device_type{0x1000, 0}, vendor{0x1018, 1}, velocity{0x6081, 0}, added{0x2000, 0};

struct Flawed {
  std::string from, to;
  int line;
  std::string message;
  EdsPart part = EdsPart::none;
  Object object{};
};

TEST(EdsFlaws, AreToldWithTheirLineAndWhatTheyConcern) {
  const std::vector<Flawed> cases{
      {"[1000]\n", "[1000\n", 7, "has no ]"},
      {"ObjectType=0x7", "ObjectType 0x7", 9, "neither [section] nor key=value"},
      {"AccessType=ro", "AccessType ro", 7, "one of ro, wo", EdsPart::access, device_type},
      {"ObjectType=0x7", "ObjectType=THING", 9, "objecttype=THING"},
      {"DataType=0x0007", "DataType=long", 10, "datatype=long", EdsPart::type, device_type},
      {"DataType=0x0007\n", "", 7, "no DataType", EdsPart::type, device_type},
      {"AccessType=ro", "AccessType=maybe", 11, "AccessType=maybe", EdsPart::access, device_type},
      {"0x00040192", "0x1FFFFFFFF", 12, "type 0007h", EdsPart::value, device_type},
      {"PDOMapping=0", "PDOMapping=2", 13, "pdomapping=2", EdsPart::mapping, device_type},
      {"ParameterName=Device type\n", "", 7, "no ParameterName"},
      {"1=0x1000", "1=0x1001", 5, "1001h is listed but not described"},
      {"2=0x1018", "", 4, "has 1 entries, not 2"},
      {"SupportedObjects=2", "SupportedObjects=many", 4, "supportedobjects=many"},
      {"SupportedObjects=2", "SupportedObjects=9", 4, "has 2 entries, not 9"},
      {"LowLimit=1", "LowLimit=100001", 31, "above HighLimit", EdsPart::low, velocity},
      {"HighLimit=100000", "HighLimit=-1", 32, "highlimit=-1", EdsPart::high, velocity},
      {"HighLimit=100000", "HighLimit=4294967296", 32, "highlimit=4294967296", EdsPart::high, velocity},
      {"DefaultValue=5000", "DefaultValue=4x0", 33, "defaultvalue=4x0", EdsPart::value, velocity},
      {"DefaultValue=0x100", "DefaultValue=0x100\nDefaultValue=2", 27, "first as 0x100 in line 26",
       EdsPart::value, vendor},
      {"DefaultValue=0x100", "DefaultValue=0x100\nDefaultValue=0X100", 27, "twice"},
      {"[1018sub0]", "[1000]", 18, "stands there twice, first in line 7"},
      {"[1018sub0]", "[1000]", 20, "datatype=5 stands there twice", EdsPart::type, device_type},
      {"[1018]", "[1019]", 18, "not described"},
      {"[1018sub1]", "[0x1018 SUB00]", 22, "section [1018sub0] stands there twice, first in line 18"},
      {"VendorNumber=0x100", "VendorNumber=0x100\nVendorNumber=1", 3, "twice"},
      {"VendorNumber=0x100", "VendorNumber=-1", 2, "vendornumber=-1"},
      {"[DeviceInfo]", "Stray=1\n[DeviceInfo]", 1, "before the first section"},
  };
  for (const auto& one : cases) {
    const auto eds = read(replaced(good, one.from, one.to));
    std::string all;
    bool found = false;
    for (const auto& flaw : eds.flaws) {
      all += std::to_string(flaw.line) + ": " + flaw.message + "\n";
      found |= flaw.line == one.line && flaw.message.find(one.message) != std::string::npos &&
               flaw.part == one.part && (one.part == EdsPart::none || flaw.concerns(one.object));
    }
    EXPECT_TRUE(found) << one.from << " -> " << one.to << "\n" << all;
    EXPECT_NE(eds.find(velocity), nullptr) << one.to << ": the rest of the file stands";
  }
}

TEST(EdsFlaws, WhatIsDoubtfulIsLeftOut) {
  const auto turned = read(replaced(good, "LowLimit=1", "LowLimit=100001"));
  EXPECT_FALSE(turned.find(velocity)->low || turned.find(velocity)->high);
  EXPECT_EQ(turned.find(velocity)->initial->value, 5000);
  const auto beyond = read(replaced(good, "HighLimit=100000", "HighLimit=4294967296"));
  EXPECT_FALSE(beyond.find(velocity)->high);
  EXPECT_EQ(beyond.find(velocity)->low->value, 1);
  const auto unknown = read(replaced(good, "AccessType=rww", "AccessType=sometimes"));
  EXPECT_FALSE(writable(unknown.find(velocity)->access)) << "nothing is written on a guess";
  const auto nameless = read(replaced(good, "ParameterName=Profile velocity\n", ""));
  EXPECT_EQ(nameless.find(velocity)->name, "Object 6081h:00");
  EXPECT_EQ(read(replaced(good, "DataType=0x0007\n", "")).find(device_type)->type, DataType::domain);
}

TEST(EdsFlaws, OfTwoLinesTheFirstStands) {
  const auto eds = read(replaced(good, "HighLimit=100000", "HighLimit=100000\nHighLimit=7"));
  EXPECT_EQ(eds.find(velocity)->high->value, 100000);
  // What the second section adds is taken.
  const auto twice = read(good + "[6081]\nDefaultValue=6000\nParameterValue=7000\n");
  EXPECT_EQ(twice.find(velocity)->initial->value, 5000);
  EXPECT_EQ(twice.find(velocity)->configured->value, 7000);
  const auto repeated = read(good + "[6081]\nDataType=7\nAccessType=rww\n");
  ASSERT_EQ(repeated.flaws.size(), 1U) << "that it says the same is told once";
  EXPECT_EQ(repeated.flaws[0].part, EdsPart::none);
}

TEST(EdsFlaws, OddWordsAreUnderstood) {
  const auto eds = with(
      "ParameterName=a\nObjectType=VAR\nDataType=UNSIGNED16\nAccessType=R/W\n"
      "LowLimit=08\nHighLimit=0x10 ; sixteen\nPDOMapping=TRUE\n");
  EXPECT_TRUE(eds.flaws.empty()) << eds.flaws.at(0).message;
  const auto* object = eds.find(added);
  ASSERT_NE(object, nullptr);
  EXPECT_EQ(object->type, DataType::unsigned16);
  EXPECT_EQ(object->access, Access::read_write);
  EXPECT_EQ(object->low->value, 8);
  EXPECT_EQ(object->high->value, 16);
  EXPECT_TRUE(object->mappable);
  for (const auto& [text, access] :
       {std::pair("Read Only", Access::read_only), std::pair("CONST", Access::constant),
        std::pair("wo", Access::write_only), std::pair("RwW", Access::read_write_output)})
    EXPECT_EQ(parse_access(text), access) << text;
  EXPECT_FALSE(parse_access(""));
  EXPECT_EQ(parse_data_type("VISIBLE_STRING"), DataType::visible_string);
  EXPECT_EQ(parse_data_type("0x2"), DataType::integer8);
  EXPECT_FALSE(parse_data_type("0"));
  EXPECT_EQ(parse_object_kind("RECORD"), ObjectKind::composed);
  EXPECT_EQ(parse_object_kind("5"), ObjectKind::type_definition);
  EXPECT_FALSE(parse_object_kind("1"));
  EXPECT_TRUE(read(good + "[0x2000 Sub 1]\nParameterName=b\nDataType=5\nAccessType=ro\n").find({0x2000, 1}));
}

TEST(EdsFlaws, AnObjectWithSubIndicesNeedsNoObjectType) {
  const auto eds = read(replaced(good, "ObjectType=9\n", ""));
  EXPECT_TRUE(eds.flaws.empty()) << eds.flaws.at(0).message;
  EXPECT_EQ(eds.find(vendor)->initial->value, 0x100);
  // Definitions of types are no objects with a value.
  EXPECT_EQ(with("ParameterName=a\nObjectType=6\n").find(added), nullptr);
}

TEST(EdsFlaws, CompactEntriesAreReadWithTheirOwnNamesAndValues) {
  const auto eds = read(good +
                        "[2000]\nParameterName=Gains\nObjectType=8\nDataType=6\nAccessType=rw\n"
                        "HighLimit=70000\nDefaultValue=$NODEID+1\nCompactSubObj=3\n"
                        "[2000Name]\nNrOfEntries=1\n2=Second\n[2000Value]\nNrOfEntries=1\n3=0x30\n"
                        "[2000sub1]\nParameterName=First\nDataType=5\nAccessType=ro\n");
  EXPECT_EQ(eds.find(added)->initial->value, 3);
  EXPECT_EQ(eds.find({0x2000, 1})->type, DataType::unsigned8) << "described by itself";
  EXPECT_EQ(eds.find({0x2000, 2})->name, "Second");
  EXPECT_EQ(eds.find({0x2000, 2})->initial->resolved(4), 5);
  EXPECT_EQ(eds.find({0x2000, 3})->configured->value, 0x30);
  ASSERT_EQ(eds.flaws.size(), 1U);
  EXPECT_TRUE(eds.flaws[0].concerns({0x2000, 3}));
  EXPECT_FALSE(eds.flaws[0].concerns({0x2000, 4}));
}

TEST(EdsFlaws, ADcfTellsHowAnObjectIsConfigured) {
  const auto eds = read(replaced(good, "DefaultValue=5000", "DefaultValue=5000\nParameterValue=0x1000"));
  EXPECT_EQ(eds.find(velocity)->initial->value, 5000);
  EXPECT_EQ(eds.find(velocity)->known()->value, 4096);
  EXPECT_EQ(eds.find(vendor)->known()->value, 0x100);
}

TEST(EdsFlaws, AnyEncodingAndLineEndIsRead) {
  std::string little("\xFF\xFE"), big("\xFE\xFF"), bare, apple;
  for (const char letter : good) {
    little += std::string{letter, '\0'};
    big += std::string{'\0', letter};
    bare += std::string{letter, '\0'};
    apple += letter == '\n' ? '\r' : letter;
  }
  for (const auto& text : {little, big, bare, apple, good + "\x1A"}) {
    const auto eds = read(text);
    EXPECT_TRUE(eds.flaws.empty());
    EXPECT_EQ(eds.objects.size(), 4U);
  }
  const auto named = parse_eds(std::string("\xFF\xFE[\0002\0000\0000\0000\0]\0\n\0x\0=\0\xFC\0\n\0", 24));
  EXPECT_TRUE(named);
  EXPECT_EQ(read(good + "[2000]\nParameterName=10 \xB5s\nDataType=5\nAccessType=ro\n").find(added)->name,
            "10 ?s");
}

}  // namespace
}  // namespace axisd::canopen
