// Stored runs of `bench speed`: what is written is read again, what is no such table is refused with its line, and a
// comparison finds what changed.
#include "runtime/measure/csv.h"
#include "runtime/measure/speed_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <string>
#include <vector>

namespace trimray {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

SpeedLine line_of(const std::string& model, const std::string& view)
{
    SpeedLine line;
    line.model = model;
    line.view = view;
    line.counts.width = 160;
    line.counts.height = 90;
    line.counts.rays = 14400;
    line.counts.leaf_visits = 1ull << 60; // no double holds its neighbours
    line.device = "CPU, avx2";
    line.times = {12.5, 0.01, 8, 0.02, {}, {}};
    return line;
}

std::string replaced(std::string text, const std::string& from, const std::string& to)
{
    EXPECT_NE(text.find(from), std::string::npos) << from;
    return text.replace(text.find(from), from.size(), to);
}

TEST(speed_table, what_is_written_is_read_again)
{
    const SpeedTable table{line_of("a.step", "iso"), line_of("a.step", "top"), line_of("odd, \"model\".tray", "iso")};
    const Result<SpeedTable> read = parse_speed_csv(speed_csv(table));
    ASSERT_TRUE(read.ok()) << read.error().where << read.error().detail;
    ASSERT_EQ(read->size(), table.size());
    for (size_t i = 0; i < table.size(); ++i) {
        EXPECT_EQ((*read)[i].model, table[i].model);
        EXPECT_EQ((*read)[i].view, table[i].view);
        EXPECT_EQ((*read)[i].device, table[i].device);
        EXPECT_EQ((*read)[i].counts, table[i].counts);
        EXPECT_EQ((*read)[i].times.speed_to_one_ray, 8);
        EXPECT_EQ((*read)[i].times.speed_to_mesh, std::nullopt);
    }
    EXPECT_TRUE(compare_speeds(*read, table).agrees());
    EXPECT_EQ(speed_csv(*read), speed_csv(table));
}

TEST(speed_table, refuses_what_is_no_such_table_and_says_where)
{
    const std::string good = speed_csv({line_of("a", "iso"), line_of("a", "top")});
    const auto error = [](const std::string& text) {
        const Result<SpeedTable> read = parse_speed_csv(text);
        EXPECT_FALSE(read.ok()) << text;
        EXPECT_EQ(read.error().code, ErrorCode::InvalidBaseline);
        return read.error().where + ": " + read.error().detail;
    };
    EXPECT_THAT(error(""), HasSubstr("line 1: these are not the columns"));
    EXPECT_THAT(error(replaced(good, "rays,", "")), HasSubstr("line 1: these are not the columns"));
    EXPECT_THAT(error(replaced(good, "\"top\",", "")), HasSubstr("line 3: expected 29 fields, found 28"));
    EXPECT_THAT(error(replaced(good, "\"top\"", "\"iso\"")), HasSubstr("line 3: a, iso is there twice"));
    EXPECT_THAT(error(replaced(good, "\"top\"", "\"top")), HasSubstr("line 3: a quoted field must end"));
    for (const char* number : {"-1", "1.5", "x", "14400 ", "99999999999999999999"})
        EXPECT_THAT(error(replaced(good, "14400", number)), HasSubstr("line 2: rays must be a whole number"));
    for (const char* number : {"-1", "nan", "inf", "1e", "8x"})
        EXPECT_THAT(error(replaced(good, ",8,", std::string(",") + number + ",")),
                    HasSubstr("line 2: speed_to_one_ray must be a number"));
    EXPECT_THAT(error(replaced(good, ",8,", ",0,")), HasSubstr("line 2: a speed must be above 0"));
}

TEST(speed_table, every_prefix_is_refused_or_read_as_whole_lines)
{
    const std::string good = speed_csv({line_of("a", "iso"), line_of("a", "top")});
    for (size_t size = 0; size < good.size(); ++size) {
        const Result<SpeedTable> read = parse_speed_csv(good.substr(0, size));
        if (read.ok()) {
            EXPECT_LE(read->size(), 2u);
            EXPECT_GE(size, good.find('\n'));
        }
    }
}

TEST(speed_table, a_changed_count_is_found)
{
    const SpeedTable stored{line_of("a", "iso"), line_of("a", "top"), line_of("gone", "iso")};
    SpeedTable now{line_of("a", "iso"), line_of("a", "top"), line_of("new", "iso")};
    now[1].counts.leaf_visits = *now[1].counts.leaf_visits + 1;
    now[0].counts.missing = 3; // not counted before
    const SpeedComparison comparison = compare_speeds(stored, now);
    EXPECT_FALSE(comparison.agrees());
    ASSERT_EQ(comparison.changed.size(), 1u);
    EXPECT_EQ(comparison.changed[0].view, "top");
    EXPECT_EQ(comparison.changed[0].count, "leaf_visits");
    EXPECT_EQ(comparison.changed[0].now - comparison.changed[0].stored, 1u);
    EXPECT_THAT(comparison.not_compared, ElementsAre("missing"));
    EXPECT_THAT(comparison.not_stored, ElementsAre(testing::Pair("new", "iso")));
    EXPECT_THAT(comparison.not_run, ElementsAre(testing::Pair("gone", "iso")));
}

TEST(speed_table, speeds_change_where_they_do_so_beyond_the_noise_of_both)
{
    const SpeedTable stored{line_of("a", "iso"), line_of("b", "iso"), line_of("c", "iso"), line_of("d", "iso")};
    SpeedTable now = stored; // noise 0.04
    now[0].times.speed_to_one_ray = 8 * 1.035;
    now[1].times.speed_to_one_ray = 8 * 1.045;
    now[2].times.speed_to_one_ray = 8 * 0.955;
    now[3].times.speed_to_one_ray_spread = std::nullopt; // fewer than three rounds
    const SpeedComparison comparison = compare_speeds(stored, now);
    EXPECT_TRUE(comparison.agrees()) << "times change, counts do not";
    std::vector<SpeedVerdict> verdicts;
    for (const ChangedSpeed& speed : comparison.speeds)
        verdicts.push_back(speed.verdict);
    EXPECT_THAT(verdicts,
                ElementsAre(SpeedVerdict::Same, SpeedVerdict::Faster, SpeedVerdict::Slower, SpeedVerdict::Open));
    EXPECT_NEAR(*comparison.mean_change("one_ray"), std::pow(1.035 * 1.045 * 0.955, 0.25), 1e-12);
    EXPECT_EQ(comparison.mean_change("mesh"), std::nullopt);
}

TEST(speed_table, times_of_another_device_are_not_compared)
{
    const SpeedTable stored{line_of("a", "iso")};
    SpeedTable now = stored;
    now[0].device = "CPU, sse4";
    const SpeedComparison comparison = compare_speeds(stored, now);
    EXPECT_TRUE(comparison.speeds.empty());
    EXPECT_EQ(comparison.other_device, "CPU, avx2");
    EXPECT_TRUE(comparison.agrees());
    now[0].times = {}; // untimed: nothing is kept from comparing
    EXPECT_EQ(compare_speeds(stored, now).other_device, "");
}

TEST(csv, fields_are_split_and_unquoted)
{
    const auto lines = parse_csv("a,\"b, \"\"c\"\"\",\r\n\n\"\",x\"y\n");
    ASSERT_TRUE(lines.ok());
    ASSERT_EQ(lines->size(), 2u);
    EXPECT_THAT((*lines)[0].fields, ElementsAre("a", "b, \"c\"", ""));
    EXPECT_EQ((*lines)[1].number, 3u);
    EXPECT_THAT((*lines)[1].fields, ElementsAre("", "x\"y"));
    for (const char* broken : {"\"a", "\"a\"b,c", "a,\"", "\"\"\""})
        EXPECT_EQ(parse_csv(broken).ok(), false) << broken;
}

} // namespace
} // namespace trimray
