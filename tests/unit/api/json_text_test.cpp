// Records as JSON, beside what protobuf's own printer makes of them.
#include "api/server/json_text.hpp"

#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "axisd/v1/audit_service.pb.h"

namespace axisd::testing {
namespace {

std::string by_protobuf(const google::protobuf::Message& message) {
  std::string text;
  google::protobuf::util::JsonPrintOptions options;
  options.preserve_proto_field_names = true;
  EXPECT_TRUE(google::protobuf::util::MessageToJsonString(message, &text, options).ok());
  return text;
}

/// Fills all that there is, some levels deep.
class Filler {
 public:
  enum class With {
    anything,
    alike,  ///< no fractions, and no text that protobuf escapes and JSON need not
  };
  explicit Filler(With with) : with_(with) {}

  void fill(google::protobuf::Message& message, int depth = 0) {
    const auto& reflection = *message.GetReflection();
    const auto& type = *message.GetDescriptor();
    if (type.full_name() == "google.protobuf.Timestamp" || type.full_name() == "google.protobuf.Duration") {
      reflection.SetInt64(&message, type.FindFieldByName("seconds"), number(2'000'000'000));
      constexpr std::array nanos{0, 120'000'000, 1'000, 7};
      reflection.SetInt32(&message, type.FindFieldByName("nanos"), nanos.at(random_() % nanos.size()));
      return;
    }
    for (int i = 0; i < type.field_count(); ++i) {
      const auto& field = *type.field(i);
      if (random_() % 3 == 0) continue;
      if (!field.is_repeated()) {
        set(message, field, depth);
        continue;
      }
      for (auto left = number(3); left > 0; --left) add(message, field, depth);
    }
  }

 private:
  using Field = google::protobuf::FieldDescriptor;
  long number(long below) { return static_cast<long>(random_() % static_cast<unsigned long>(below)); }
  std::string text() {
    std::string all;
    for (auto left = number(20); left > 0; --left) all += static_cast<char>(' ' + number('~' - ' ' + 1));
    if (with_ == With::alike) std::erase_if(all, [](char c) { return c == '<' || c == '>'; });
    return all;
  }
  double real() {
    constexpr std::array special{0.0, 1.0, 0.1, 1e300, 5e-324, 1.0 / 3, 120.0, 1e15, 123456789012345678.0};
    const auto some = static_cast<double>(static_cast<std::int64_t>(random_())) / 1e12;
    if (with_ == With::alike) return std::trunc(some);
    return random_() % 2 == 0 ? special.at(random_() % special.size()) : some;
  }
  void set(google::protobuf::Message& message, const Field& field, int depth) {
    const auto& to = *message.GetReflection();
    switch (field.cpp_type()) {
      case Field::CPPTYPE_INT32:
        return to.SetInt32(&message, &field, static_cast<int>(random_()));
      case Field::CPPTYPE_UINT32:
        return to.SetUInt32(&message, &field, static_cast<unsigned>(random_()));
      case Field::CPPTYPE_INT64:
        return to.SetInt64(&message, &field, static_cast<std::int64_t>(random_()));
      case Field::CPPTYPE_UINT64:
        return to.SetUInt64(&message, &field, random_());
      case Field::CPPTYPE_BOOL:
        return to.SetBool(&message, &field, random_() % 2 == 0);
      case Field::CPPTYPE_DOUBLE:
        return to.SetDouble(&message, &field, real());
      case Field::CPPTYPE_ENUM:  // some of them a number that the enum does not have
        return to.SetEnumValue(&message, &field,
                               static_cast<int>(number(field.enum_type()->value_count() + 2)));
      case Field::CPPTYPE_STRING:
        return to.SetString(&message, &field, text());
      case Field::CPPTYPE_MESSAGE:
        if (depth < 6) fill(*to.MutableMessage(&message, &field), depth + 1);
        return;
      case Field::CPPTYPE_FLOAT:
        FAIL() << field.full_name();
    }
  }
  void add(google::protobuf::Message& message, const Field& field, int depth) {
    const auto& to = *message.GetReflection();
    switch (field.cpp_type()) {
      case Field::CPPTYPE_UINT32:
        return to.AddUInt32(&message, &field, static_cast<unsigned>(random_()));
      case Field::CPPTYPE_STRING:
        return to.AddString(&message, &field, text());
      case Field::CPPTYPE_ENUM:
        return to.AddEnumValue(&message, &field, static_cast<int>(number(field.enum_type()->value_count())));
      case Field::CPPTYPE_MESSAGE:
        if (depth < 6) fill(*to.AddMessage(&message, &field), depth + 1);
        return;
      default:
        FAIL() << field.full_name();
    }
  }

  With with_;
  std::mt19937_64 random_{24};
};

TEST(JsonText, IsProtobufsOwnApartFromFractionsAndEscapes) {
  Filler filler(Filler::With::alike);
  for (int i = 0; i < 1000; ++i) {
    v1::AuditRecord record;
    filler.fill(record);
    ASSERT_EQ(server::json_text(record), by_protobuf(record)) << i;
  }
}

TEST(JsonText, IsReadAsTheMessageThatItIs) {
  Filler filler(Filler::With::anything);
  for (int i = 0; i < 1000; ++i) {
    v1::AuditRecord record, again;
    filler.fill(record);
    const auto text = server::json_text(record);
    ASSERT_TRUE(text);
    ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(*text, &again).ok()) << *text;
    ASSERT_EQ(again.SerializeAsString(), record.SerializeAsString()) << *text;
  }
}

TEST(JsonText, NumbersAreWholeWhereTheyCan) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  const std::vector<std::pair<double, std::string>> numbers{
      {0, "0"},
      {-0.0, "-0E0"},
      {120, "120"},
      {-7, "-7"},
      {12.5, "1.25E1"},
      {999'999'999'999'999, "999999999999999"},
      {1e15, "1E15"},
      {infinity, R"("Infinity")"},
      {-infinity, R"("-Infinity")"},
      {std::numeric_limits<double>::quiet_NaN(), R"("NaN")"},
  };
  for (const auto& [number, text] : numbers) {
    v1::MotionValues values;
    values.set_position(number);
    EXPECT_EQ(server::json_text(values), R"({"position":)" + text + "}");
  }
}

TEST(JsonText, TextsThatNeedEscapes) {
  v1::AuditRecord record;
  record.set_client("a\"b\\c\nd\x01<Zuf\u00FChrung>");
  EXPECT_EQ(server::json_text(record), "{\"client\":\"a\\\"b\\\\c\\nd\\u0001<Zuf\u00FChrung>\"}");
}

TEST(JsonText, WhatHasNoTextIsNotMadeUp) {
  v1::AuditRecord record;
  for (const char* text : {"\xFF", "\xC0\x80", "cut\xC3"}) {
    record.set_client(text);
    EXPECT_FALSE(server::json_text(record)) << text;
  }
  record.Clear();
  record.mutable_at()->set_seconds(253'402'300'800);
  EXPECT_FALSE(server::json_text(record)) << "the year 10000";
  record.Clear();
  record.mutable_uptime()->set_seconds(1);
  record.mutable_uptime()->set_nanos(-1);
  EXPECT_FALSE(server::json_text(record)) << "two signs";
  google::protobuf::Struct map;
  (*map.mutable_fields())["a"].set_number_value(0.1);
  EXPECT_FALSE(server::json_text(map));
}

}  // namespace
}  // namespace axisd::testing
