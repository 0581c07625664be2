#include "daemon/link/request.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>

namespace axisd::link {
namespace {

using Names = std::vector<std::string>;

TEST(Request, OneVerbAndOneName) {
  const auto cycle = parse_request("cycle can0");
  ASSERT_TRUE(cycle);
  EXPECT_EQ(cycle->verb, Verb::cycle);
  EXPECT_EQ(cycle->interface, "can0");
  const auto check = parse_request("check  vcan-1.b_2\r");
  ASSERT_TRUE(check);
  EXPECT_EQ(check->verb, Verb::check);
  EXPECT_EQ(check->interface, "vcan-1.b_2");
}

TEST(Request, AnythingElseIsRefused) {
  for (const auto* text :
       {"", "cycle", "cycle ", "cycle can0 can1", "up can0", "CYCLE can0", "cycle can0;reboot",
        "cycle ../can0", "cycle ..", "cycle a/b", "cycle a-name-of-more-than-15", "can0"})
    EXPECT_FALSE(parse_request(text)) << text;
  EXPECT_FALSE(parse_request(std::string_view("cycle can0\0x", 12)));
}

TEST(Links, OnePerLineWithComments) {
  const auto links = parse_links("# CAN links\ncan0\n\n  can1  # the second cell\nvcan0");
  ASSERT_TRUE(links);
  EXPECT_EQ(*links, (Names{"can0", "can1", "vcan0"}));
  EXPECT_EQ(parse_links("").value(), Names{});
}

TEST(Links, AWordThatIsNoNameRefusesTheFile) {
  for (const auto* text : {"can0\n*", "can0\na-name-of-more-than-15", "../x", "can0,can1"}) {
    const auto links = parse_links(text);
    ASSERT_FALSE(links) << text;
    EXPECT_FALSE(links.error().remedy.empty());
  }
}

TEST(Links, OnlyThoseOfTheFile) {
  EXPECT_TRUE(permitted("can0", {"can1", "can0"}, "/etc/axisd/links"));
  const auto refused = permitted("can2", {"can1", "can0"}, "/etc/axisd/links");
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("can2"), std::string::npos);
  EXPECT_NE(refused.error().message.find("/etc/axisd/links"), std::string::npos);
  EXPECT_FALSE(permitted("can", {"can0"}, "f"));
}

TEST(Links, AFileThatOthersCanWriteIsNotBelieved) {
  const auto path = testing::TempDir() + "axisd-links-" + std::to_string(::getpid());
  EXPECT_FALSE(read_links(path)) << "there is none";
  std::ofstream(path) << "can0\n";
  ASSERT_EQ(::chmod(path.c_str(), 0644), 0);
  EXPECT_EQ(read_links(path).value(), Names{"can0"});
  for (const mode_t mode : {0664, 0646}) {
    ASSERT_EQ(::chmod(path.c_str(), mode), 0);
    EXPECT_FALSE(read_links(path)) << mode;
  }
  ASSERT_EQ(::chmod(path.c_str(), 0644), 0);
  std::ofstream(path) << std::string(5000, '#');
  EXPECT_FALSE(read_links(path)) << "too long";
  ::unlink(path.c_str());
  EXPECT_FALSE(read_links(testing::TempDir())) << "a directory";
}

}  // namespace
}  // namespace axisd::link
