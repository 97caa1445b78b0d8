// A model's bytes out of files, compression and archives, sound and damaged ones, and the hashes of them.
#include "preprocess/source/source_file.h"

#include "format/cad_names.h"
#include "preprocess/source/content_hash.h"
#include "preprocess/source/step_references.h"
#include "preprocess/source/zip_archive.h"

#include <archive.h>
#include <archive_entry.h>
#include <filesystem>
#include <fmt/format.h>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <iterator>
#include <random>
#include <sys/stat.h>
#include <zlib.h>
#include <zstd.h>

namespace {

using namespace trimray;
namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;

/// A folder of this test alone, gone with it.
class source_file : public testing::Test {
protected:
    source_file()
    {
        std::string name = (fs::temp_directory_path() / "trimray-source-test-XXXXXX").string();
        folder_ = ::mkdtemp(name.data());
    }
    ~source_file() override { fs::remove_all(folder_); }

    std::string write(const std::string& name, const std::string& content) const
    {
        const fs::path path = folder_ / name;
        fs::create_directories(path.parent_path());
        fs::remove(path); // some file systems flush a file that is cut and written anew
        std::ofstream(path, std::ios::binary) << content;
        return path.string();
    }

    std::string path(const std::string& name) const { return (folder_ / name).string(); }

    fs::path folder_;
};

/// Looks like a model, and does not compress to nothing.
std::string model_text(size_t lines)
{
    std::mt19937 random(7);
    std::string text = "ISO-10303-21;\nDATA;\n";
    for (size_t i = 0; i < lines; ++i)
        text += fmt::format("#{}=CARTESIAN_POINT('',({}.,{}.,0.));\n", i + 1, random() % 1000, random());
    return text + "ENDSEC;\nEND-ISO-10303-21;\n";
}

std::string gzip(const std::string& text)
{
    z_stream stream{};
    deflateInit2(&stream, 9, Z_DEFLATED, 16 + MAX_WBITS, 8, Z_DEFAULT_STRATEGY);
    std::string out(deflateBound(&stream, text.size()) + 32, 0);
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(text.data()));
    stream.avail_in = static_cast<uInt>(text.size());
    stream.next_out = reinterpret_cast<Bytef*>(out.data());
    stream.avail_out = static_cast<uInt>(out.size());
    EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
    out.resize(stream.total_out);
    deflateEnd(&stream);
    return out;
}

/// With a checksum, as the zstd program makes it.
std::string zstd(const std::string& text)
{
    const std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)> context{ZSTD_createCCtx(), &ZSTD_freeCCtx};
    ZSTD_CCtx_setParameter(context.get(), ZSTD_c_checksumFlag, 1);
    std::string out(ZSTD_compressBound(text.size()), 0);
    out.resize(ZSTD_compress2(context.get(), out.data(), out.size(), text.data(), text.size()));
    return out;
}

struct Entry {
    std::string path, content;
    unsigned type = AE_IFREG;
};

std::string zip(const std::vector<Entry>& entries, const char* password = nullptr)
{
    std::string out(1 << 20, 0);
    for (const Entry& entry : entries)
        out.resize(out.size() + entry.content.size() + 256);
    size_t used = 0;
    archive* writer = archive_write_new();
    archive_write_set_format_zip(writer);
    archive_write_set_options(writer, password != nullptr ? "zip:hdrcharset=UTF-8,zip:encryption=traditional"
                                                          : "zip:compression=deflate");
    if (password != nullptr)
        archive_write_set_passphrase(writer, password);
    EXPECT_EQ(archive_write_open_memory(writer, out.data(), out.size(), &used), ARCHIVE_OK);
    for (const Entry& one : entries) {
        archive_entry* entry = archive_entry_new();
        archive_entry_set_pathname(entry, one.path.c_str());
        archive_entry_set_filetype(entry, one.type);
        archive_entry_set_perm(entry, 0644);
        if (one.type == AE_IFLNK)
            archive_entry_set_symlink(entry, one.content.c_str());
        archive_entry_set_size(entry, one.type == AE_IFREG ? static_cast<la_int64_t>(one.content.size()) : 0);
        EXPECT_EQ(archive_write_header(writer, entry), ARCHIVE_OK) << archive_error_string(writer);
        if (one.type == AE_IFREG)
            archive_write_data(writer, one.content.data(), one.content.size());
        archive_entry_free(entry);
    }
    archive_write_close(writer);
    archive_write_free(writer);
    out.resize(used);
    return out;
}

std::string read(const std::string& path)
{
    std::ifstream stream(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
}

void expect_error(const Result<SourceFile>& opened, ErrorCode code, const std::string& says)
{
    ASSERT_FALSE(opened.ok());
    EXPECT_EQ(opened.error().code, code) << opened.error().detail;
    EXPECT_THAT(opened.error().where + ": " + opened.error().detail, HasSubstr(says));
}

TEST(cad_names, endings_decide_in_capitals_or_not)
{
    for (const char* name : {"a.step", "b/a.STP", "a.b.iges", "a.igs.GZ", "a.brep.zst", "a.p21"})
        EXPECT_TRUE(is_cad_name(name)) << name;
    for (const char* name : {"step", ".step", "a/.stp", "a.step/b", "a.txt", "a.gz", "a.step.zip", "a.step.gz.gz", ""})
        EXPECT_FALSE(is_cad_name(name)) << name;
    EXPECT_EQ(cad_family("a.Igs"), CadFamily::Iges);
    EXPECT_FALSE(cad_family("a.igs.gz").has_value());
    EXPECT_EQ(without_compression("a/b.step.gz"), "a/b.step");
    EXPECT_EQ(without_folder("a/b.step"), "b.step");
    EXPECT_EQ(without_folder("b.step"), "b.step");
}

TEST_F(source_file, hashes_are_those_of_xxh128sum)
{
    EXPECT_EQ(SourceFile::open(write("a.step", ""))->hash, "xxh3-128:99aa06d3014798d86001c324468d497f");
    EXPECT_EQ(SourceFile::open(write("a.step", "abc"))->hash, "xxh3-128:06b05ab6733a618578af5f94892f3950");
}

TEST_F(source_file, compression_and_archives_do_not_change_content_hash_or_name)
{
    const std::string text = model_text(20'000), half = text.substr(0, text.size() / 2),
                      rest = text.substr(text.size() / 2);
    const std::string archive = write("parts.zip", zip({{"gears", "", AE_IFDIR},
                                                        {"gears/a.step", text},
                                                        {"gears/packed/a.step.gz", gzip(text)},
                                                        {"/tmp/../a.step.zst", zstd(text)},
                                                        {"other.txt", "other"}}));
    const std::string plain = write("a.step", text);
    const Result<SourceFile> expected = SourceFile::open(plain);
    ASSERT_TRUE(expected.ok());
    EXPECT_EQ(expected->path, plain);
    for (const std::string& model :
         {plain, write("a.step.gz", gzip(text)), write("a.step.zst", zstd(text)),
          write("two/a.step.gz", gzip(half) + gzip(rest)), write("two/a.step.zst", zstd(half) + zstd(rest)),
          archive + "!/gears/a.step", archive + "!/gears/packed/a.step.gz", archive + "!//tmp/../a.step.zst"}) {
        const Result<SourceFile> source = SourceFile::open(model);
        ASSERT_TRUE(source.ok()) << model << ": " << source.error().detail;
        EXPECT_EQ(source->name, "a.step") << model;
        EXPECT_EQ(source->bytes, text.size()) << model;
        EXPECT_EQ(source->hash, expected->hash) << model;
        EXPECT_EQ(source->content_hash, expected->hash) << model;
        EXPECT_EQ(read(source->path), text) << model;
        EXPECT_EQ(source->file, model.substr(0, model.find("!/"))) << model;
    }
}

TEST_F(source_file, the_importer_gets_an_absolute_path)
{
    const std::string model = write("folder/a.step", "x");
    const fs::path before = fs::current_path();
    fs::current_path(folder_);
    const Result<SourceFile> source = SourceFile::open("folder/a.step");
    fs::current_path(before);
    ASSERT_TRUE(source.ok());
    EXPECT_EQ(source->path, fs::canonical(folder_).string() + "/folder/a.step");
    EXPECT_EQ(source->file, "folder/a.step");
}

TEST_F(source_file, only_one_level_of_compression_is_undone)
{
    const std::string once = gzip(model_text(10));
    const Result<SourceFile> source = SourceFile::open(write("a.step.gz", gzip(once)));
    ASSERT_TRUE(source.ok());
    EXPECT_EQ(read(source->path), once);
}

TEST_F(source_file, a_file_that_is_really_called_so_comes_before_a_member)
{
    write("a.zip", zip({{"b.step", "in the archive"}}));
    const std::string model = path("a.zip") + "!/b.step";
    EXPECT_EQ(SourceFile::open(model)->bytes, 14u);
    fs::remove(path("a.zip"));
    write("a.zip!/b.step", "a file");
    EXPECT_EQ(read(SourceFile::open(model)->path), "a file");
    const std::string deep = write("a.zip!/c.zip", zip({{"d!/e.stp", "deep"}}));
    EXPECT_EQ(read(SourceFile::open(deep + "!/d!/e.stp")->path), "deep");
}

TEST_F(source_file, an_archive_alone_stands_for_its_only_cad_file)
{
    const std::string one = write("one.zip", zip({{"README.txt", "x"}, {"a/b.step", "the model"}}));
    const Result<SourceFile> source = SourceFile::open(one);
    ASSERT_TRUE(source.ok());
    EXPECT_EQ(source->name, "b.step");
    EXPECT_EQ(read(source->path), "the model");

    const std::string many = write("many.zip", zip({{"d.igs", ""}, {"c.stp", ""}, {"b.brep", ""}, {"a.step", ""}}));
    expect_error(SourceFile::open(many), ErrorCode::Usage, "holds 4 CAD files; name one: " + many + "!/a.step, ");
    expect_error(SourceFile::open(write("none.zip", zip({{"a.txt", ""}}))), ErrorCode::EmptyCad, "no CAD file");
    expect_error(SourceFile::open(write("empty.zip", zip({}))), ErrorCode::EmptyCad, "no CAD file");
}

TEST_F(source_file, members_are_listed_by_name_and_only_cad_files)
{
    const std::string text = model_text(100);
    const std::string archive = write("a.zip", zip({{"z/b.STEP", text},
                                                    {"z.step", "", AE_IFDIR},
                                                    {"link.step", "z/b.STEP", AE_IFLNK},
                                                    {"__MACOSX/z/b.step", "fork"},
                                                    {"z/._b.step", "fork"},
                                                    {"notes.txt", "x"},
                                                    {"a.stp.gz", gzip(text)},
                                                    {"Gehäuse.igs", "12345"},
                                                    {"z/b.STEP", "the second of that name"}}));
    const Result<std::vector<ArchiveMember>> members = list_members(archive);
    ASSERT_TRUE(members.ok()) << members.error().detail;
    std::vector<std::string> paths;
    std::vector<int64_t> bytes;
    for (const ArchiveMember& member : *members) {
        paths.push_back(member.path);
        bytes.push_back(member.bytes);
    }
    EXPECT_THAT(paths, ElementsAre("Gehäuse.igs", "a.stp.gz", "z/b.STEP"));
    EXPECT_THAT(bytes, ElementsAre(5, -1, static_cast<int64_t>(text.size())));
    EXPECT_EQ(read(SourceFile::open(archive + "!/Gehäuse.igs")->path), "12345");
    EXPECT_EQ(SourceFile::open(archive + "!/z/b.STEP")->bytes, text.size()) << "the first of that name";
    expect_error(SourceFile::open(archive + "!/link.step"), ErrorCode::UnsupportedFormat, "a link");
    expect_error(SourceFile::open(archive + "!/y.step"), ErrorCode::FileNotFound, "no such member");
}

TEST_F(source_file, what_cannot_be_opened_is_named_with_the_reason)
{
    const std::string text = model_text(100);
    expect_error(SourceFile::open(path("missing.step")), ErrorCode::FileNotFound, "missing.step");
    expect_error(SourceFile::open(path("missing.zip") + "!/a.step"), ErrorCode::FileNotFound, "missing.zip!/a.step");
    expect_error(SourceFile::open(folder_.string()), ErrorCode::FileNotReadable, "regular file");
    expect_error(SourceFile::open(write("a.step", text) + "!/b.step"), ErrorCode::UnsupportedFormat, "no zip archive");
    EXPECT_EQ(list_members(path("a.step")).error().code, ErrorCode::UnsupportedFormat);
    const std::string secret = write("secret.zip", zip({{"a.step", text}}, "password"));
    EXPECT_EQ(list_members(secret)->size(), 1u);
    expect_error(SourceFile::open(secret), ErrorCode::UnsupportedFormat, "secret.zip!/a.step: is encrypted");
    expect_error(SourceFile::open(write("a.step.gz", gzip(text) + "more")), ErrorCode::InvalidCad, "gzip compression");
    std::string flipped = gzip(text);
    flipped[flipped.size() - 8] ^= 1; // the checksum's first byte
    expect_error(SourceFile::open(write("a.step.gz", flipped)), ErrorCode::InvalidCad, "data check");
}

TEST_F(source_file, bombs_end_at_the_limits)
{
    const std::string zeros(1 << 20, '0');
    const SourceLimits limits{(1 << 20) - 1, 2};
    const std::string says = "decompresses to more than";
    expect_error(SourceFile::open(write("a.step.gz", gzip(zeros)), limits), ErrorCode::InvalidCad, says);
    expect_error(SourceFile::open(write("a.step.zst", zstd(zeros)), limits), ErrorCode::InvalidCad, says);
    const std::string archive = write("a.zip", zip({{"a.step", zeros}, {"b.step.gz", gzip(zeros)}}));
    expect_error(SourceFile::open(archive + "!/a.step", limits), ErrorCode::InvalidCad, says);
    expect_error(SourceFile::open(archive + "!/b.step.gz", limits), ErrorCode::InvalidCad, says);
    EXPECT_TRUE(SourceFile::open(archive + "!/b.step.gz", {1 << 20, 2}).ok());
    const std::string three = write("three.zip", zip({{"a.txt", ""}, {"b.txt", ""}, {"c.step", ""}}));
    expect_error(SourceFile::open(three, limits), ErrorCode::UnsupportedFormat, "more than 2 files");
    expect_error(SourceFile::open(three + "!/c.step", limits), ErrorCode::UnsupportedFormat, "more than 2 files");
    EXPECT_TRUE(SourceFile::open(write("plain.step", zeros), limits).ok()) << "the limit is for what grows";
}

/// Every packed form of one model: its file's name, its bytes, and what to add to the path.
struct Packed {
    const char* name;
    std::string bytes, member;
};

std::vector<Packed> packed_forms(const std::string& text)
{
    return {{"a.step.gz", gzip(text), ""},
            {"a.step.zst", zstd(text), ""},
            {"a.zip", zip({{"b.txt", "beside"}, {"a.step", text}}), "!/a.step"},
            {"b.zip", zip({{"a.step.gz", gzip(text)}}), "!/a.step.gz"}};
}

TEST_F(source_file, every_truncation_is_noticed)
{
    for (const Packed& form : packed_forms(model_text(12)))
        for (size_t size = 4; size < form.bytes.size(); ++size) { // the first four say what it is
            const Result<SourceFile> source =
                SourceFile::open(write(form.name, form.bytes.substr(0, size)) + form.member);
            ASSERT_FALSE(source.ok()) << form.name << " cut to " << size;
            ASSERT_NE(exit_code(source.error()), kExitInternal) << source.error().detail;
        }
}

TEST_F(source_file, damaged_bytes_give_an_error_or_the_very_content)
{
    const std::string text = model_text(12);
    const std::string hash = SourceFile::open(write("a.step", text))->hash;
    std::mt19937 random(11);
    size_t noticed = 0, harmless = 0;
    for (const Packed& form : packed_forms(text))
        for (int i = 0; i < 1000; ++i) {
            std::string bytes = form.bytes;
            for (unsigned changes = 1 + random() % 3; changes > 0; --changes)
                bytes[4 + random() % (bytes.size() - 4)] = static_cast<char>(random());
            const std::string file = write(form.name, bytes);
            if (!form.member.empty())
                (void)list_members(file).ok(); // whatever it says, it comes back
            const Result<SourceFile> source = SourceFile::open(file + form.member);
            ASSERT_EQ(source.ok() ? source->hash : hash, hash) << form.name << ", change " << i;
            ++(source.ok() ? harmless : noticed);
        }
    EXPECT_GT(noticed, 2000u);
    EXPECT_GT(harmless, 50u);
}

TEST(step_references, are_found_wherever_chunks_end)
{
    const std::string text =
        "#1=PRODUCT('DOCUMENT of a fan','x;y',$);\n#2=DOCUMENT_FILE('HEAD.stp','',$,$,#3,'',$);\n"
        "#4=CARTESIAN_POINT('not me',(0.,1.));\n"
        "#5 = APPLIED_EXTERNAL_IDENTIFICATION_ASSIGNMENT ( 'O''Brien; 2.stp',\n  #6,#7,(#2));\n"
        "#7=EXTERNAL_SOURCE(IDENTIFIER('Geh\\X2\\00E4\\X0\\use.stp'));#8=DOCUMENT('','part.stp','',#9);"
        "#9=PRODUCT('nor me','',$);\n";
    StepReferences whole;
    whole.add(text);
    for (const char* name : {"HEAD.stp", "O'Brien; 2.stp", "Gehäuse.stp", "Geh\\X2\\00E4\\X0\\use.stp", "part.stp"})
        EXPECT_THAT(whole.names(), testing::Contains(name));
    EXPECT_THAT(whole.names(), testing::Each(testing::Not(HasSubstr("me"))));
    for (size_t first = 1; first < text.size(); ++first) {
        StepReferences cut;
        cut.add(std::string_view(text).substr(0, first));
        cut.add(std::string_view(text).substr(first));
        ASSERT_EQ(cut.names(), whole.names()) << first;
    }
    for (const size_t size : {1, 2, 7, 8, 9}) {
        StepReferences cut;
        for (size_t at = 0; at < text.size(); at += size)
            cut.add(std::string_view(text).substr(at, size));
        EXPECT_EQ(cut.names(), whole.names()) << size;
    }
}

TEST(step_references, escapes_become_utf8)
{
    EXPECT_EQ(decode_step_string("a\\X\\E4b"), "aäb");
    EXPECT_EQ(decode_step_string("\\X2\\00E420AC\\X0\\.stp"), "ä€.stp");
    EXPECT_EQ(decode_step_string("\\X4\\0001F529\\X0\\"), "🔩");
    EXPECT_EQ(decode_step_string("\\X2\\D83DDD29\\X0\\"), "🔩");
    for (const char* damaged : {"\\X2\\00", "\\X\\", "\\X4\\XYZ", "\\X2\\", "\\"})
        EXPECT_LE(decode_step_string(damaged).size(), 4u) << damaged;
}

class references : public source_file {
protected:
    static std::string referring(const std::string& name)
    {
        return "ISO-10303-21;\n#1=DOCUMENT_FILE('" + name + "','',$,$,#2,'',$);\n";
    }
    std::string content_hash(const std::string& name) const
    {
        const Result<SourceFile> source = SourceFile::open(path(name));
        EXPECT_TRUE(source.ok()) << source.error().detail;
        return source->content_hash;
    }
};

TEST_F(references, the_files_that_a_model_refers_to_are_part_of_its_content)
{
    for (const char* folder : {"one/", "same/", "other/", "deep/", "lone/"}) {
        const std::string in = folder;
        write(in + "top.stp", referring("sub/part.stp"));
        if (in != "lone/")
            write(in + "sub/part.stp", in == "other/" ? "x" : referring("bolt.stp"));
        if (in != "lone/")
            write(in + "sub/bolt.stp", in == "deep/" ? "another bolt" : "bolt");
    }
    EXPECT_EQ(content_hash("one/top.stp"), content_hash("same/top.stp"));
    EXPECT_NE(content_hash("one/top.stp"), content_hash("other/top.stp"));
    EXPECT_NE(content_hash("one/top.stp"), content_hash("deep/top.stp"));
    EXPECT_NE(content_hash("one/top.stp"), content_hash("lone/top.stp"));
    const Result<SourceFile> lone = SourceFile::open(path("lone/top.stp")), one = SourceFile::open(path("one/top.stp"));
    EXPECT_EQ(lone->content_hash, lone->hash);
    EXPECT_EQ(one->hash, lone->hash);
    EXPECT_THAT(one->content_hash, testing::MatchesRegex("xxh3-128:[0-9a-f]+"));
    EXPECT_EQ(one->content_hash.size(), one->hash.size());
    write("one/top.stp.gz", gzip(referring("sub/part.stp")));
    EXPECT_EQ(content_hash("one/top.stp.gz"), lone->hash) << "the importer finds no files beside a temporary one";
}

TEST_F(references, circles_end_and_what_is_no_file_is_passed_over)
{
    write("top.stp", referring("top.stp") + referring("./top.stp") + referring("pipe") + referring("/dev/zero") +
                         referring("/proc/kmsg") + referring("sub") + referring("empty"));
    fs::create_directory(path("sub"));
    write("empty", "");
    ASSERT_EQ(::mkfifo(path("pipe").c_str(), 0600), 0);
    EXPECT_EQ(content_hash("top.stp"), SourceFile::open(path("top.stp"))->hash);
    write("a.stp", referring("b.stp"));
    write("b.stp", referring("a.stp") + referring("b.stp"));
    const std::string circle = content_hash("a.stp");
    EXPECT_NE(circle, SourceFile::open(path("a.stp"))->hash);
    write("b.stp", referring("a.stp") + referring("c.stp"));
    EXPECT_NE(content_hash("a.stp"), circle);
}

} // namespace
