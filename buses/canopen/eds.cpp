#include "buses/canopen/eds.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/property_tree/ini_parser.hpp>
#include <boost/property_tree/ptree.hpp>
#include <set>
#include <sstream>
#include <tuple>
#include <utility>

#include "buses/canopen/eds_values.hpp"
#include "buses/regular_file.hpp"

namespace axisd::canopen {

namespace {

using Tree = boost::property_tree::ptree;

/// One section: keys in lower case (CiA 306 does not care), and the lines where they stand.
struct Section {
  int line = 0;
  std::map<std::string, std::string> values;
  std::map<std::string, int> lines;
};
using Sections = std::map<std::string, Section>;

class Reader {
 public:
  std::expected<Eds, std::vector<EdsProblem>> read(std::string_view text) {
    if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
    if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF"))
      problem(0, "the file is UTF-16: save it as ASCII or UTF-8");
    else if (text.size() > eds_size_limit)
      problem(0, fmt::format("the file has {} bytes, at most {} are read", text.size(), eds_size_limit));
    else if (text.find('\0') != std::string_view::npos)
      problem(0, "the file is not a text file");
    else if (read_sections(text))
      read_all();
    if (problems_.empty()) return std::move(eds_);
    std::ranges::sort(problems_, {}, [](const EdsProblem& one) { return std::tie(one.line, one.message); });
    return std::unexpected(std::move(problems_));
  }

 private:
  void problem(int line, std::string_view message) {
    if (problems_.size() < eds_problem_limit) problems_.push_back({line, printable(message)});
  }

  bool read_sections(std::string_view text) {
    Tree tree;
    try {
      std::istringstream stream{std::string(text)};
      boost::property_tree::read_ini(stream, tree);
    } catch (const boost::property_tree::ini_parser_error& error) {
      problem(static_cast<int>(error.line()), error.message());
      return false;
    }
    for (const auto& [name, keys] : tree) {
      const auto [at, added] = sections_.try_emplace(lower_case(name));
      if (!added) problem(0, fmt::format("section [{}] stands there twice", name));
      for (const auto& [key, value] : keys) at->second.values.insert_or_assign(lower_case(key), value.data());
    }
    find_lines(text);
    return true;
  }

  /// The parser keeps no lines; for messages a look at each line is enough.
  void find_lines(std::string_view text) {
    Section* section = nullptr;
    for (int line = 1; !text.empty(); ++line) {
      const auto end = std::min(text.find('\n'), text.size());
      const auto content = trimmed(text.substr(0, end));
      text.remove_prefix(std::min(end + 1, text.size()));
      if (content.starts_with('[')) {
        const auto found = sections_.find(lower_case(trimmed(content.substr(1, content.find(']') - 1))));
        section = found == sections_.end() ? nullptr : &found->second;
        if (section != nullptr) section->line = line;
      } else if (const auto equals = content.find('=');
                 section != nullptr && equals != std::string_view::npos) {
        section->lines.try_emplace(lower_case(trimmed(content.substr(0, equals))), line);
      }
    }
  }

  void read_all() {
    read_device();
    for (const auto& [name, section] : sections_)
      if (const auto parsed = parse_object_section(name)) read_object(*parsed, name, section);
    for (const auto* list : {"mandatoryobjects", "optionalobjects", "manufacturerobjects"}) check_list(list);
    if (eds_.objects.empty() && problems_.empty()) problem(0, "no object is described");
  }

  static std::string text_of(const Section& section, const std::string& key) {
    const auto found = section.values.find(key);
    return found == section.values.end() ? std::string() : std::string(trimmed(found->second));
  }
  static int line_of(const Section& section, const std::string& key) {
    const auto found = section.lines.find(key);
    return found == section.lines.end() ? section.line : found->second;
  }

  /// Nothing, and a problem unless the key is absent or empty.
  std::optional<std::int64_t> integer(const Section& section, const std::string& key, std::int64_t most) {
    const auto text = text_of(section, key);
    if (text.empty()) return std::nullopt;
    const auto value = parse_integer(text);
    if (value && *value >= 0 && *value <= most) return value;
    problem(line_of(section, key), fmt::format("{}={}: not a number from 0 to {}", key, text, most));
    return std::nullopt;
  }

  void read_device() {
    const auto found = sections_.find("deviceinfo");
    if (found == sections_.end()) return;
    const auto number = [&](const char* key) -> std::optional<std::uint32_t> {
      const auto value = integer(found->second, key, 0xFFFFFFFF);
      return value ? std::optional(static_cast<std::uint32_t>(*value)) : std::nullopt;
    };
    eds_.vendor_name = text_of(found->second, "vendorname");
    eds_.product_name = text_of(found->second, "productname");
    eds_.vendor = number("vendornumber");
    eds_.product = number("productnumber");
    eds_.revision = number("revisionnumber");
  }

  void read_object(const ObjectSection& where, const std::string& name, const Section& section) {
    constexpr std::int64_t domain = 2, array = 8, record = 9;
    if (where.has_sub && !sections_.contains(name.substr(0, name.find("sub"))))
      problem(section.line, fmt::format("[{}] belongs to an object that is not described", name));
    const auto kind = integer(section, "objecttype", 0xFF).value_or(7);
    const bool composed = !where.has_sub && (kind == array || kind == record);
    if (composed) {
      const auto compact = integer(section, "compactsubobj", 0xFE).value_or(0);
      if (compact > 0) read_compact(where.object, name, section, compact);
      return;
    }
    read_entry(where.object, name, section, kind == domain ? std::optional(DataType::domain) : std::nullopt);
  }

  /// CompactSubObj: that many entries alike, described once, with names in a section of their own.
  void read_compact(Object object, const std::string& name, const Section& section, std::int64_t count) {
    const auto names = sections_.find(name + "name");
    add({.object = object,
         .name = "NrOfObjects",
         .type = DataType::unsigned8,
         .access = Access::read_only,
         .initial = EdsNumber{.value = count}},
        section.line);
    for (int sub = 1; sub <= count; ++sub) {
      object.sub = static_cast<std::uint8_t>(sub);
      auto entry = parse_entry(object, name, section, std::nullopt);
      if (!entry) return;
      const auto own = names == sections_.end() ? std::string() : text_of(names->second, std::to_string(sub));
      entry->name = own.empty() ? fmt::format("{}{}", entry->name, sub) : printable(own);
      add(std::move(*entry), section.line);
    }
  }

  void read_entry(Object object, const std::string& name, const Section& section,
                  std::optional<DataType> type) {
    if (auto entry = parse_entry(object, name, section, type)) add(std::move(*entry), section.line);
  }

  void add(EdsObject&& entry, int line) {
    if (eds_.objects.size() >= eds_object_limit) {
      problem(line, fmt::format("more than {} objects", eds_object_limit));
      return;
    }
    const auto object = entry.object;
    if (!eds_.objects.try_emplace(object, std::move(entry)).second)
      problem(line, fmt::format("object {} is described twice", to_string(object)));
  }

  std::optional<EdsObject> parse_entry(Object object, const std::string& name, const Section& section,
                                       std::optional<DataType> type) {
    EdsObject entry{.object = object, .name = printable(text_of(section, "parametername"))};
    const auto before = problems_.size();
    if (entry.name.empty()) problem(section.line, fmt::format("[{}] has no ParameterName", name));
    const auto code = integer(section, "datatype", 0xFFFF);
    if (!code && !type && problems_.size() == before)
      problem(section.line, fmt::format("[{}] has no DataType", name));
    entry.type = code ? static_cast<DataType>(*code) : type.value_or(DataType::domain);
    const auto access_text = text_of(section, "accesstype");
    const auto access = parse_access(access_text);
    if (access)
      entry.access = *access;
    else if (!access_text.empty() || !type)
      problem(line_of(section, "accesstype"),
              fmt::format("AccessType={}: one of ro, wo, rw, rwr, rww, const", access_text));
    entry.mappable = integer(section, "pdomapping", 1).value_or(0) != 0;
    parse_values(entry, section);
    if (problems_.size() != before) return std::nullopt;
    return entry;
  }

  void parse_values(EdsObject& entry, const Section& section) {
    using Kind = TypeInfo::Kind;
    const auto kind = info(entry.type).kind;
    const auto initial = text_of(section, "defaultvalue");
    if (kind == Kind::text || kind == Kind::other) {
      entry.text_initial = initial;
      return;
    }
    if (kind == Kind::real) {
      entry.real_initial = parse_real(initial);
      if (!initial.empty() && !entry.real_initial)
        problem(line_of(section, "defaultvalue"), fmt::format("DefaultValue={}: not a number", initial));
      return;
    }
    entry.low = number(section, "lowlimit", entry.type);
    entry.high = number(section, "highlimit", entry.type);
    entry.initial = number(section, "defaultvalue", entry.type);
    const bool plain = entry.low && entry.high && !entry.low->plus_node_id && !entry.high->plus_node_id;
    const bool natural_64 = kind == Kind::natural && info(entry.type).bits == 64;  // may have wrapped
    if (plain && !natural_64 && entry.low->value > entry.high->value)
      problem(line_of(section, "lowlimit"),
              fmt::format("LowLimit={} is above HighLimit={}", entry.low->value, entry.high->value));
  }

  std::optional<EdsNumber> number(const Section& section, const std::string& key, DataType type) {
    const auto text = text_of(section, key);
    if (text.empty()) return std::nullopt;
    auto value = parse_number(text, type);
    if (!value)
      problem(line_of(section, key),
              fmt::format("{}={}: not a number that the type {:04X}h of the object can hold", key, text,
                          std::to_underlying(type)));
    return value;
  }

  /// Objects that a list promises must be described. Described ones that no list names are taken all the
  /// same.
  void check_list(const std::string& list) {
    const auto found = sections_.find(list);
    if (found == sections_.end()) return;
    const auto count = integer(found->second, "supportedobjects", 0xFFFF).value_or(0);
    for (std::int64_t i = 1; i <= count && problems_.size() < eds_problem_limit; ++i) {
      const auto key = std::to_string(i);
      const auto index = integer(found->second, key, 0xFFFF);
      if (!index) {
        if (text_of(found->second, key).empty())
          problem(found->second.line, fmt::format("[{}] has no entry {} of {}", list, key, count));
      } else if (!sections_.contains(fmt::format("{:04x}", *index))) {
        problem(line_of(found->second, key),
                fmt::format("object {:04X}h is listed but not described", *index));
      }
    }
  }

  Sections sections_;
  Eds eds_;
  std::vector<EdsProblem> problems_;
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
              "correct the file, or get another one from the vendor");
}

}  // namespace axisd::canopen
