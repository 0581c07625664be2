#include "buses/canopen/eds.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>
#include <utility>

#include "buses/canopen/eds_sections.hpp"
#include "buses/canopen/eds_values.hpp"
#include "buses/regular_file.hpp"

namespace axisd::canopen {

namespace {

/// Entries that one section describes: one, or several alike.
struct Described {
  Object object;
  std::uint8_t last_sub = 0;
};

EdsPart part_of(std::string_view key) {
  static constexpr auto parts =
      std::to_array<std::pair<std::string_view, EdsPart>>({{"datatype", EdsPart::type},
                                                           {"accesstype", EdsPart::access},
                                                           {"lowlimit", EdsPart::low},
                                                           {"highlimit", EdsPart::high},
                                                           {"defaultvalue", EdsPart::value},
                                                           {"parametervalue", EdsPart::value},
                                                           {"pdomapping", EdsPart::mapping}});
  const auto found = std::ranges::find(parts, key, [](const auto& one) { return one.first; });
  return found == parts.end() ? EdsPart::none : found->second;
}

class Reader {
 public:
  std::expected<Eds, std::vector<EdsProblem>> read(std::string_view file) {
    if (file.size() > eds_size_limit)
      return refused(fmt::format("the file has {} bytes, at most {} are read", file.size(), eds_size_limit));
    const auto text = decode_eds(file);
    if (!text) return refused(text.error());
    auto [sections, remarks] = split_eds(*text, eds_flaw_limit);
    sections_ = std::move(sections);
    for (const auto& [line, section, key, message] : remarks) {
      const auto object = parse_object_section(section);
      flaw(line, message, object ? part_of(key) : EdsPart::none, described(object.value_or(ObjectSection{})));
    }
    read_device();
    for (const auto& [name, section] : sections_)
      if (const auto parsed = parse_object_section(name)) read_object(*parsed, name, section);
    for (const auto* list : {"mandatoryobjects", "optionalobjects", "manufacturerobjects"}) check_list(list);
    if (too_many_objects_) return refused(fmt::format("more than {} objects", eds_object_limit));
    if (eds_.flaws.size() > eds_flaw_limit)
      return refused(fmt::format("more than {} lines are wrong: it is no data sheet", eds_flaw_limit));
    if (eds_.objects.empty()) return refused("no object is described: it is no data sheet");
    std::ranges::sort(eds_.flaws, {}, [](const EdsFlaw& one) { return std::tie(one.line, one.message); });
    return std::move(eds_);
  }

 private:
  static std::unexpected<std::vector<EdsProblem>> refused(std::string_view message) {
    return std::unexpected(std::vector<EdsProblem>{{0, printable(message)}});
  }
  void flaw(int line, std::string_view message, EdsPart part = EdsPart::none, const Described& of = {}) {
    if (eds_.flaws.size() > eds_flaw_limit) return;
    eds_.flaws.push_back({line, printable(message), part, of.object, of.last_sub});
  }
  /// A value that is left out.
  void flaw(const EdsSection& section, const std::string& key, std::string_view what, const Described& of) {
    flaw(section.line_of(key), fmt::format("{}={}: {}", key, section.text(key), what), part_of(key), of);
  }
  static Described described(const ObjectSection& section) { return {section.object, section.object.sub}; }

  /// Nothing, and a flaw unless the key is absent or empty.
  std::optional<std::int64_t> integer(const EdsSection& section, const std::string& key, std::int64_t most) {
    const auto text = section.word(key);
    if (text.empty()) return std::nullopt;
    const auto value = parse_integer(text);
    if (value && *value >= 0 && *value <= most) return value;
    flaw(section, key, fmt::format("not a number from 0 to {}", most), {});
    return std::nullopt;
  }

  void read_device() {
    const auto found = sections_.find("deviceinfo");
    if (found == sections_.end()) return;
    const auto number = [&](const char* key) -> std::optional<std::uint32_t> {
      const auto value = integer(found->second, key, 0xFFFFFFFF);
      return value ? std::optional(static_cast<std::uint32_t>(*value)) : std::nullopt;
    };
    eds_.vendor_name = found->second.text("vendorname");
    eds_.product_name = found->second.text("productname");
    eds_.vendor = number("vendornumber");
    eds_.product = number("productnumber");
    eds_.revision = number("revisionnumber");
  }

  ObjectKind kind_of(const ObjectSection& where, const EdsSection& section) {
    const auto text = section.word("objecttype");
    const auto kind = parse_object_kind(text);
    if (!kind && !text.empty()) flaw(section, "objecttype", "not an object code of CiA 301", {});
    if (kind) return *kind;
    const bool parts = !where.has_sub && section.has("subnumber") && !section.has("datatype");
    return parts ? ObjectKind::composed : ObjectKind::variable;
  }

  void read_object(const ObjectSection& where, const std::string& name, const EdsSection& section) {
    if (where.has_sub && !sections_.contains(name.substr(0, name.find("sub"))))
      flaw(section.line, fmt::format("[{}] belongs to an object that is not described", name));
    const auto kind = kind_of(where, section);
    if (kind == ObjectKind::null || kind == ObjectKind::type_definition) return;
    const bool composed = !where.has_sub && kind == ObjectKind::composed;
    if (!composed) {
      const auto type = kind == ObjectKind::domain ? std::optional(DataType::domain) : std::nullopt;
      add(parse_entry(described(where), name, section, type), section.line);
      return;
    }
    constexpr std::int64_t most_subs = 0xFE;
    const auto count = integer(section, "compactsubobj", most_subs).value_or(0);
    if (count > 0) read_compact(where.object, name, section, static_cast<std::uint8_t>(count));
  }

  /// CompactSubObj: that many entries alike, described once; names, and values of a DCF, have sections of
  /// their own. An entry with a section of its own stands before these.
  void read_compact(Object object, const std::string& name, const EdsSection& section, std::uint8_t count) {
    const auto own_text = [&](const char* list, unsigned sub) {
      const auto found = sections_.find(name + list);
      return found == sections_.end() ? std::string() : found->second.word(std::to_string(sub));
    };
    const auto is_described = [&](unsigned sub) {
      return sections_.contains(fmt::format("{}sub{:x}", name, sub));
    };
    const auto common = parse_entry({{object.index, 1}, count}, name, section, std::nullopt);
    if (!is_described(0))
      add({.object = object,
           .name = "NrOfObjects",
           .type = DataType::unsigned8,
           .access = Access::read_only,
           .initial = EdsNumber{.value = count}},
          section.line);
    for (unsigned sub = 1; sub <= count; ++sub) {
      if (is_described(sub)) continue;
      auto entry = common;
      entry.object.sub = static_cast<std::uint8_t>(sub);
      const auto own = own_text("name", sub);
      entry.name = own.empty() ? fmt::format("{}{}", entry.name, sub) : printable(own);
      if (const auto value = own_text("value", sub); !value.empty())
        entry.configured = parse_number(value, entry.type);
      add(std::move(entry), section.line);
    }
  }

  void add(EdsObject&& entry, int line) {
    if (eds_.objects.size() >= eds_object_limit) {
      too_many_objects_ = true;
      return;
    }
    const auto object = entry.object;
    if (!eds_.objects.try_emplace(object, std::move(entry)).second)
      flaw(line, fmt::format("object {} is described twice", to_string(object)));
  }

  EdsObject parse_entry(const Described& of, const std::string& name, const EdsSection& section,
                        std::optional<DataType> type) {
    EdsObject entry{.object = of.object, .name = printable(section.text("parametername"))};
    if (entry.name.empty()) {
      flaw(section.line, fmt::format("[{}] has no ParameterName", name));
      entry.name = fmt::format("Object {}", to_string(of.object));
    }
    const auto code = section.word("datatype");
    const auto own_type = parse_data_type(code);
    if (!own_type && !code.empty())
      flaw(section, "datatype", "not a data type of CiA 301", of);
    else if (!own_type && !type)
      flaw(section.line, fmt::format("[{}] has no DataType", name), EdsPart::type, of);
    entry.type = own_type.value_or(type.value_or(DataType::domain));
    const auto access_text = section.word("accesstype");
    const auto access = parse_access(access_text);
    if (!access && (!access_text.empty() || !type))
      flaw(section.line_of("accesstype"),
           fmt::format("AccessType={}: one of ro, wo, rw, rwr, rww, const", access_text), EdsPart::access,
           of);
    // Nothing is written that is not known to be writable.
    entry.access = access.value_or(type ? Access::read_write : Access::read_only);
    const auto mapping = section.word("pdomapping");
    const auto mappable = parse_flag(mapping);
    if (!mappable && !mapping.empty()) flaw(section, "pdomapping", "neither 0 nor 1", of);
    entry.mappable = mappable.value_or(false);
    parse_values(entry, section, of);
    return entry;
  }

  void parse_values(EdsObject& entry, const EdsSection& section, const Described& of) {
    using Kind = TypeInfo::Kind;
    const auto kind = info(entry.type).kind;
    if (kind == Kind::text || kind == Kind::other) {
      entry.text_initial = section.text("defaultvalue");
      return;
    }
    if (kind == Kind::real) {
      const auto initial = section.word("defaultvalue");
      entry.real_initial = parse_real(initial);
      if (!initial.empty() && !entry.real_initial) flaw(section, "defaultvalue", "not a number", of);
      return;
    }
    entry.low = number(section, "lowlimit", entry.type, of);
    entry.high = number(section, "highlimit", entry.type, of);
    entry.initial = number(section, "defaultvalue", entry.type, of);
    entry.configured = number(section, "parametervalue", entry.type, of);
    const bool plain = entry.low && entry.high && !entry.low->plus_node_id && !entry.high->plus_node_id;
    const bool natural_64 = kind == Kind::natural && info(entry.type).bits == 64;  // may have wrapped
    if (!plain || natural_64 || entry.low->value <= entry.high->value) return;
    const auto what = fmt::format("LowLimit={} is above HighLimit={}", entry.low->value, entry.high->value);
    flaw(section.line_of("lowlimit"), what, EdsPart::low, of);
    flaw(section.line_of("highlimit"), what, EdsPart::high, of);
    entry.low = entry.high = std::nullopt;
  }

  std::optional<EdsNumber> number(const EdsSection& section, const std::string& key, DataType type,
                                  const Described& of) {
    const auto text = section.word(key);
    if (text.empty()) return std::nullopt;
    auto value = parse_number(text, type);
    if (!value)
      flaw(section, key,
           fmt::format("not a number that the type {:04X}h of the object can hold", std::to_underlying(type)),
           of);
    return value;
  }

  /// Of the objects that a list promises. Described ones that no list names are taken all the same.
  void check_list(const std::string& list) {
    const auto found = sections_.find(list);
    if (found == sections_.end()) return;
    const auto& section = found->second;
    const auto count = integer(section, "supportedobjects", 0xFFFF).value_or(0);
    const auto entries = std::ranges::count_if(section.entries, [](const auto& entry) {
      return entry.first.find_first_not_of("0123456789") == std::string::npos;
    });
    if (count != entries)
      flaw(section.line_of("supportedobjects"),
           fmt::format("[{}] has {} entries, not {} as it says", list, entries, count));
    for (const auto& [key, entry] : section.entries) {
      if (key.find_first_not_of("0123456789") != std::string::npos) continue;
      const auto index = integer(section, key, 0xFFFF);
      if (index && !sections_.contains(fmt::format("{:04x}", *index)))
        flaw(entry.line, fmt::format("object {:04X}h is listed but not described", *index));
    }
  }

  std::map<std::string, EdsSection> sections_;
  bool too_many_objects_ = false;
  Eds eds_;
};

}  // namespace

std::expected<Eds, std::vector<EdsProblem>> parse_eds(std::string_view text) { return Reader().read(text); }

Result<Eds> load_eds(const std::string& path) {
  const auto text = read_regular_file(path, eds_size_limit);
  if (!text) return fail(text.error());
  auto eds = parse_eds(*text);
  if (eds) return std::move(*eds);
  std::string message;
  for (const auto& [line, what] : eds.error())
    message += line == 0 ? fmt::format("{}{}: {}", message.empty() ? "" : "\n", path, what)
                         : fmt::format("{}{}:{}: {}", message.empty() ? "" : "\n", path, line, what);
  return fail(Reason::invalid_argument, std::move(message),
              "name the EDS or DCF (CiA 306) that the maker of the drive has for it");
}

}  // namespace axisd::canopen
