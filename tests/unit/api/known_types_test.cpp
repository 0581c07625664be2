// Types that are described once print what types do that are described anew each time.
#include "api/server/known_types.hpp"

#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <random>
#include <string>

#include "axisd/v1/audit_service.pb.h"

namespace axisd::testing {
namespace {

std::string by_descriptors(const google::protobuf::Message& message) {
  std::string text;
  google::protobuf::util::JsonPrintOptions options;
  options.preserve_proto_field_names = true;
  EXPECT_TRUE(google::protobuf::util::MessageToJsonString(message, &text, options).ok());
  return text;
}

std::string by_known_types(server::KnownTypes& types, const google::protobuf::Message& message) {
  std::string text;
  google::protobuf::util::JsonPrintOptions options;
  options.preserve_proto_field_names = true;
  const auto url = std::string(server::KnownTypes::prefix) + "/" + message.GetDescriptor()->full_name();
  EXPECT_TRUE(
      google::protobuf::util::BinaryToJsonString(&types, url, message.SerializeAsString(), &text, options)
          .ok());
  return text;
}

/// Fills all that there is, some levels deep.
class Filler {
 public:
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
    return all;
  }
  double real() {
    constexpr std::array special{0.0, 1.0, 0.1, 1e300, 5e-324, 1.0 / 3, 120.0, 1e15, 123456789012345678.0};
    const auto some = static_cast<double>(static_cast<std::int64_t>(random_())) / 1e12;
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

  std::mt19937_64 random_{24};
};

TEST(KnownTypes, PrintWhatIsPrintedWithoutThem) {
  Filler filler;
  server::KnownTypes types;
  for (int i = 0; i < 2000; ++i) {
    v1::AuditRecord record;
    filler.fill(record);
    ASSERT_EQ(by_known_types(types, record), by_descriptors(record)) << i;
  }
}

TEST(KnownTypes, SoDoMaps) {
  server::KnownTypes types;
  google::protobuf::Struct map;
  (*map.mutable_fields())["a"].set_number_value(0.1);
  (*map.mutable_fields())["b"].set_string_value("Zuf\u00FChrung");
  for (int i = 0; i < 2; ++i) EXPECT_EQ(by_known_types(types, map), by_descriptors(map));
}

TEST(KnownTypes, WhatIsNoTypeStaysUnknown) {
  server::KnownTypes types;
  google::protobuf::Type type;
  google::protobuf::Enum values;
  for (int i = 0; i < 2; ++i) {
    EXPECT_FALSE(types.ResolveMessageType("type.googleapis.com/axisd.v1.Nothing", &type).ok());
    EXPECT_FALSE(types.ResolveEnumType("type.googleapis.com/axisd.v1.Nothing", &values).ok());
  }
}

}  // namespace
}  // namespace axisd::testing
