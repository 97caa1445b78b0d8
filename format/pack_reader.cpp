#include "format/pack_reader.h"

#include "format/derive.h"
#include "format/load_watch.h"
#include "format/pack_file.h"
#include "format/pack_filter.h"
#include "format/pack_predict.h"
#include "format/trim_texture.h"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <memory>
#include <set>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <tbb/parallel_for.h>
#include <unistd.h>
#include <zstd.h>

namespace trimray {
namespace {

using Bytes = std::vector<std::byte>;
using ByteSpan = std::span<const std::byte>;

/// Where the bytes come from: memory, or a file through pread (a file truncated meanwhile reads short and is refused;
/// a mapping of it would crash).
class ByteSource {
public:
    explicit ByteSource(ByteSpan bytes) : bytes_(bytes), size_(bytes.size()) {}
    ByteSource(int descriptor, uint64_t size) : descriptor_(descriptor), size_(size) {}
    uint64_t size() const { return size_; }

    /// offset + out.size() <= size(). Returns false if the file no longer has these bytes.
    bool read(uint64_t offset, std::span<std::byte> out) const
    {
        if (descriptor_ < 0) {
            std::copy_n(bytes_.begin() + static_cast<ptrdiff_t>(offset), out.size(), out.begin());
            return true;
        }
        while (!out.empty()) {
            const ssize_t n = ::pread(descriptor_, out.data(), out.size(), static_cast<off_t>(offset));
            if (n < 0 && errno == EINTR)
                continue;
            if (n <= 0)
                return false;
            out = out.subspan(static_cast<size_t>(n));
            offset += static_cast<uint64_t>(n);
        }
        return true;
    }

private:
    ByteSpan bytes_;
    int descriptor_ = -1;
    uint64_t size_ = 0;
};

std::string id_of(const SectionEntry& entry)
{
    return std::string(entry.id, 4);
}

bool has_id_letters(const SectionEntry& entry)
{
    const auto is_letter = [](char c) { return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z'); };
    return is_letter(entry.id[0]) &&
           std::all_of(entry.id + 1, entry.id + 4, [&](char c) { return is_letter(c) || (c >= '0' && c <= '9'); });
}

/// What a reader of this version knows about a section. stride 0: unknown id.
struct KnownSection {
    uint32_t stride = 0;
    bool is_derived = false;
};

KnownSection known_section(std::string_view id)
{
    if (id == kSectionFacts)
        return {sizeof(FactRecord), false};
    for (const std::string_view text :
         {kSectionProvenance, kSectionStrings, kSectionPreview256, kSectionPreview512, kSectionProxy})
        if (id == text)
            return {1, false};
    KnownSection known;
    PackImage image;
    for_each_array(image, [&](std::string_view array_id, bool is_derived, const auto& array) {
        using T = typename std::decay_t<decltype(array)>::value_type;
        if (id == array_id)
            known = {section_stride<T>(id), is_derived};
    });
    return known;
}

class PackDecoder {
public:
    PackDecoder(const ByteSource& source, const ReadOptions& options, const LoadWatch& watch, bool keep_going)
        : source_(source), options_(options), watch_(watch), keep_going_(keep_going)
    {
    }

    std::vector<Finding> findings;
    LoadedPack pack;

    void run_previews()
    {
        if (!read_header() || !read_table())
            return;
        check_sections();
        for (size_t i = 0; i < table_.size() && findings.empty(); ++i)
            if (const std::string id = id_of(table_[i]); id == kSectionPreview256 || id == kSectionPreview512)
                load_section(i);
    }

    void run()
    {
        if (!read_header() || !read_table())
            return;
        check_sections();
        if (!findings.empty())
            return; // sizes and offsets cannot be trusted: nothing is allocated from them
        if (!load_all_sections() || !findings.empty())
            return;
        check_facts();
        if (!findings.empty())
            return;
        if (pack.image.compact)
            derive();
        if (findings.empty() && !watch_.is_cancelled())
            findings = validate_image(pack.image, watch_.cancelled);
    }

private:
    /// False: given up.
    bool load_all_sections()
    {
        std::vector<bool> loaded(table_.size());
        const auto load = [&](size_t i) {
            if (!loaded[i] && (keep_going_ || findings.empty()) && !watch_.is_cancelled())
                load_section(i);
            loaded[i] = true;
        };
        if (tells_outline()) {
            for (size_t i = 0; i < table_.size(); ++i)
                if (is_in_outline(id_of(table_[i])))
                    load(i);
            tell_outline();
        }
        for (size_t i = 0; i < table_.size(); ++i)
            load(i);
        return !watch_.is_cancelled();
    }

    bool has_proxy() const
    {
        return std::any_of(table_.begin(), table_.end(),
                           [](const SectionEntry& e) { return id_of(e) == kSectionProxy; });
    }

    bool tells_outline() const { return watch_.on_outline && !pack.image.compact && has_proxy(); }

    /// The smaller part, from which a first picture can be drawn.
    static bool is_in_outline(const std::string& id)
    {
        constexpr std::string_view kLater[] = {
            kSectionPreview256, kSectionPreview512, "CTRL", "TPNT", "TPCE", "CELL", "CENT", "SDFW"};
        return std::find(std::begin(kLater), std::end(kLater), id) == std::end(kLater);
    }

    void tell_outline()
    {
        if (!findings.empty() || watch_.is_cancelled())
            return;
        check_facts();
        const bool is_valid = findings.empty() && is_valid_outline(pack.image, watch_.cancelled);
        findings.clear(); // the checks of the whole find them again
        if (!is_valid)
            return;
        PackImage outline = pack.image;
        if (!options_.previews_and_proxy)
            pack.image.proxy_draco = {};
        watch_.on_outline(std::move(outline));
    }

    void fault(int number, std::string section, std::string detail)
    {
        findings.push_back({number, std::move(section), std::move(detail)});
    }

    bool read_header()
    {
        pack.file_bytes = source_.size();
        if (source_.size() < sizeof header_) {
            fault(3101, "header", fmt::format("expected at least {} bytes, found {}", sizeof header_, source_.size()));
            return false;
        }
        if (!source_.read(0, std::as_writable_bytes(std::span(&header_, 1)))) {
            fault(3100, "header", "the file became shorter while it was read");
            return false;
        }
        if (!check_identifier())
            return false;
        if (header_.header_xxh3 != xxh3(&header_, offsetof(PackHeader, header_xxh3))) {
            fault(3104, "header", "its checksum does not match");
            return false;
        }
        pack.version_major = header_.version_major;
        pack.version_minor = header_.version_minor;
        pack.content_id = header_.content_id;
        if (header_.version_major != kPackVersionMajor) {
            fault(3105, "header",
                  fmt::format("version {}.{}; this reader knows {}.x", header_.version_major, header_.version_minor,
                              kPackVersionMajor));
            return false;
        }
        if (header_.state != static_cast<uint32_t>(PackState::Closed))
            fault(3106, "header", "its writer did not finish");
        if (header_.file_bytes != source_.size())
            fault(3107, "header",
                  fmt::format("expected a file of {} bytes, found {}", header_.file_bytes, source_.size()));
        if (const uint64_t unknown = header_.required_features & ~kKnownRequiredFeatures)
            fault(3122, "header", fmt::format("needs features {:#x}, unknown to this reader", unknown));
        if (std::any_of(std::begin(header_.reserved), std::end(header_.reserved), [](uint64_t r) { return r != 0; }))
            fault(3108, "header", "reserved bytes are not zero");
        pack.image.compact = header_.required_features & kFeatureCompact;
        return findings.empty();
    }

    bool check_identifier()
    {
        const unsigned char* found = header_.identifier;
        if (std::equal(kPackIdentifier.begin(), kPackIdentifier.end(), found))
            return true;
        if (std::equal(found + 1, found + 7, kPackIdentifier.begin() + 1))
            fault(3102, "header", "damaged in transfer: sent as text, or its high bits were cut");
        else
            fault(3103, "header", "not a scene pack: its identifier is missing");
        return false;
    }

    bool read_table()
    {
        const uint64_t count = header_.section_count;
        if (count == 0 || count > kMaxSections || header_.table_offset != sizeof header_ ||
            count * sizeof(SectionEntry) > source_.size() - sizeof header_) {
            fault(3109, "table", fmt::format("{} sections at offset {}", count, header_.table_offset));
            return false;
        }
        table_.resize(count);
        if (!source_.read(header_.table_offset, std::as_writable_bytes(std::span(table_)))) {
            fault(3100, "table", "the file became shorter while it was read");
            return false;
        }
        if (header_.table_xxh3 != xxh3(table_.data(), table_.size() * sizeof(SectionEntry))) {
            fault(3110, "table", "its checksum does not match");
            return false;
        }
        for (const SectionEntry& e : table_)
            pack.sections.push_back({id_of(e), e.stored_bytes, e.decoded_bytes, e.count, is_critical(id_of(e))});
        return true;
    }

    /// All that the table says, checked against the file, the limits and the budget before anything is allocated.
    void check_sections()
    {
        uint64_t end = sizeof header_ + table_.size() * sizeof(SectionEntry);
        uint64_t decoded_bytes = 0, wanted_bytes = 0;
        std::set<std::string> seen;
        for (const SectionEntry& e : table_) {
            const std::string id = id_of(e);
            if (!has_id_letters(e)) {
                fault(3111, "table", "a section's id is not a letter and three letters or digits");
                return;
            }
            if (!seen.insert(id).second)
                fault(3112, id, "appears twice");
            if (!check_place(e, end) || !check_form(e))
                return; // one entry that lies makes the following ones meaningless
            end = e.offset + e.stored_bytes;
            if (e.decoded_bytes > UINT64_MAX - decoded_bytes) {
                fault(3115, id, "decoded sizes overflow");
                return;
            }
            decoded_bytes += e.decoded_bytes;
            if (is_wanted(e))
                wanted_bytes += e.decoded_bytes;
        }
        if (end != source_.size())
            fault(3107, "table", fmt::format("sections end at {}, the file at {}", end, source_.size()));
        if (decoded_bytes != header_.decoded_bytes)
            fault(3120, "header",
                  fmt::format("total decoded size {}, sections add up to {}", header_.decoded_bytes, decoded_bytes));
        if (header_.content_id != content_id(table_))
            fault(3119, "header", "the content id is not that of the sections");
        if (wanted_bytes > options_.max_decoded_bytes)
            fault(3123, "table",
                  fmt::format("{} bytes decoded, the budget is {}", wanted_bytes, options_.max_decoded_bytes));
        if (!seen.contains(std::string(kSectionFacts)))
            fault(3124, std::string(kSectionFacts), "missing");
    }

    bool check_place(const SectionEntry& e, uint64_t end)
    {
        const uint64_t size = source_.size();
        const uint64_t alignment = section_alignment(e);
        if (e.offset % alignment != 0 || e.offset < end || e.offset - end >= alignment || e.offset > size ||
            e.stored_bytes > size - e.offset) {
            fault(3113, id_of(e),
                  fmt::format("{} bytes at offset {}; expected within {} bytes, at the first multiple of {} from {}",
                              e.stored_bytes, e.offset, size, alignment, end));
            return false;
        }
        std::byte padding[kPlainAlignment];
        const std::span gap(padding, e.offset - end);
        if (!source_.read(end, gap)) {
            fault(3100, id_of(e), "the file became shorter while it was read");
            return false;
        }
        if (std::any_of(gap.begin(), gap.end(), [](std::byte b) { return b != std::byte{0}; }))
            fault(3114, id_of(e), "padding before it is not zero");
        return true;
    }

    bool check_form(const SectionEntry& e)
    {
        const std::string id = id_of(e);
        const KnownSection known = known_section(id);
        const size_t before = findings.size();
        if (known.stride == 0 && is_critical(id))
            fault(3121, id, "critical, and unknown to this reader");
        if (e.codec > kCodecZstd || e.filter > kFilterPredicted) {
            if (known.stride != 0 || is_critical(id))
                fault(3125, id, fmt::format("codec {}, filter {}: unknown to this reader", e.codec, e.filter));
            return findings.size() == before; // an ancillary section of the future is skipped, form and all
        }
        if (known.stride != 0 && e.stride != known.stride)
            fault(3116, id, fmt::format("elements of {} bytes, expected {}", e.stride, known.stride));
        if (e.stride == 0 || e.stride > kMaxStride || e.count == 0 || e.count > kMaxElements ||
            e.decoded_bytes != e.count * e.stride)
            fault(3115, id,
                  fmt::format("{} elements of {} bytes do not make {} bytes", e.count, e.stride, e.decoded_bytes));
        if (e.codec == kCodecPlain && (e.stored_bytes != e.decoded_bytes || e.filter != kFilterNone))
            fault(3115, id, "plain, but stored and decoded size differ");
        const bool has_columns = e.stride > 0 && e.stride % 4 == 0 && e.stride <= 4 * kMaxFilterColumns;
        const uint64_t allowed =
            e.filter == kFilterNone || !has_columns ? 0 : ~uint64_t{0} >> (kMaxFilterColumns - e.stride / 4);
        if (e.filter == kFilterPredicted && !has_prediction(id))
            fault(3126, id, "has no prediction to differ from");
        else if (e.filter != kFilterNone && !has_columns)
            fault(3126, id, fmt::format("elements of {} bytes have no columns", e.stride));
        else if (((e.delta_columns | e.plane_columns) & ~allowed) != 0)
            fault(3126, id, "filters columns that it does not have");
        if (e.reserved != 0)
            fault(3108, id, "reserved bytes are not zero");
        if (known.is_derived && pack.image.compact)
            fault(3127, id, "stored, but the pack says that it is compact");
        return findings.size() == before;
    }

    bool is_wanted(const SectionEntry& e) const
    {
        const std::string id = id_of(e);
        if (known_section(id).stride == 0)
            return false;
        if (id == kSectionProxy && tells_outline())
            return true;
        const bool is_extra = id == kSectionPreview256 || id == kSectionPreview512 || id == kSectionProxy;
        return options_.previews_and_proxy || !is_extra;
    }

    void load_section(size_t index)
    {
        const SectionEntry& e = table_[index];
        const std::string id = id_of(e);
        if (!is_wanted(e)) {
            if (keep_going_)
                check_stored_bytes(e); // a section that is skipped still has its checksum
            return;
        }
        if (id == kSectionFacts) {
            decode_into(e, std::as_writable_bytes(std::span(&facts_, 1)));
            return;
        }
        Bytes text;
        Bytes* bytes = id == kSectionPreview256                            ? &pack.image.preview_256_png
                       : id == kSectionPreview512                          ? &pack.image.preview_512_png
                       : id == kSectionProxy                               ? &pack.image.proxy_draco
                       : id == kSectionStrings || id == kSectionProvenance ? &text
                                                                           : nullptr;
        if (bytes) {
            bytes->resize(e.decoded_bytes);
            if (decode_into(e, *bytes) && bytes == &text)
                keep_text(id, text);
            return;
        }
        for_each_array(pack.image, [&](std::string_view array_id, bool, auto& array) {
            if (id != array_id)
                return;
            array.resize(e.decoded_bytes / sizeof(array[0]));
            decode_into(e, std::as_writable_bytes(std::span(array)));
        });
    }

    bool read_stored(const SectionEntry& e, Bytes& stored)
    {
        stored.resize(e.stored_bytes);
        constexpr size_t kPiece = 16 << 20; // a few milliseconds from memory, a tenth of a second from a slow disk
        for (size_t done = 0; done < stored.size(); done += kPiece) {
            if (watch_.is_cancelled())
                return false;
            const size_t size = std::min(kPiece, stored.size() - done);
            if (!source_.read(e.offset + done, std::span(stored).subspan(done, size))) {
                fault(3100, id_of(e), "the file became shorter while it was read");
                return false;
            }
        }
        if (watch_.is_cancelled())
            return false;
        if (xxh3(stored.data(), stored.size()) != e.stored_xxh3) {
            fault(3117, id_of(e), "the checksum of its stored bytes does not match");
            return false;
        }
        return true;
    }

    void check_stored_bytes(const SectionEntry& e)
    {
        Bytes stored;
        read_stored(e, stored);
    }

    /// out.size() == e.decoded_bytes.
    bool decode_into(const SectionEntry& e, std::span<std::byte> out)
    {
        Bytes stored;
        if (!read_stored(e, stored))
            return false;
        if (e.codec == kCodecPlain)
            std::copy(stored.begin(), stored.end(), out.begin());
        else if (!decompress(e, stored, out))
            return false;
        if (xxh3(out.data(), out.size()) != e.decoded_xxh3) {
            fault(3118, id_of(e), "the checksum of its decoded bytes does not match");
            return false;
        }
        return true;
    }

    bool decompress(const SectionEntry& e, ByteSpan stored, std::span<std::byte> out)
    {
        const uint64_t frame_bytes = records_per_frame(e.stride) * e.stride;
        std::vector<ByteSpan> frames;
        for (uint64_t decoded = 0; decoded < out.size(); decoded += frame_bytes) {
            const uint64_t expected = std::min<uint64_t>(frame_bytes, out.size() - decoded);
            const size_t size = ZSTD_findFrameCompressedSize(stored.data(), stored.size());
            if (ZSTD_isError(size) || ZSTD_getFrameContentSize(stored.data(), stored.size()) != expected) {
                fault(3128, id_of(e), fmt::format("frame {} does not hold {} bytes", frames.size(), expected));
                return false;
            }
            frames.push_back(stored.first(size));
            stored = stored.subspan(size);
        }
        if (!stored.empty()) {
            fault(3128, id_of(e), fmt::format("{} bytes after its last frame", stored.size()));
            return false;
        }
        std::atomic<size_t> damaged = SIZE_MAX;
        tbb::parallel_for(size_t{0}, frames.size(), [&](size_t i) {
            if (watch_.is_cancelled())
                return;
            std::span<std::byte> target = out.subspan(i * frame_bytes);
            target = target.first(std::min<size_t>(target.size(), frame_bytes));
            Bytes columns;
            std::span<std::byte> decoded = target;
            if (e.filter != kFilterNone) {
                columns.resize(target.size());
                decoded = columns;
            }
            if (ZSTD_decompress(decoded.data(), decoded.size(), frames[i].data(), frames[i].size()) != decoded.size()) {
                damaged = i;
                return;
            }
            if (e.filter != kFilterNone)
                unfilter_columns(columns, e.stride, {e.delta_columns, e.plane_columns}, target);
        });
        if (damaged != SIZE_MAX) {
            fault(3128, id_of(e), fmt::format("frame {} is damaged", damaged.load()));
            return false;
        }
        if (watch_.is_cancelled())
            return false;
        if (e.filter == kFilterPredicted)
            restore_records(id_of(e), pack.image, out);
        return true;
    }

    /// NUL-terminated strings, one after another.
    void keep_text(const std::string& id, const Bytes& text)
    {
        if (text.back() != std::byte{0}) {
            fault(3129, id, "its last string does not end");
            return;
        }
        std::vector<std::string> strings;
        const char* first = reinterpret_cast<const char*>(text.data());
        for (const char *s = first, *end = first + text.size(); s != end; s += strings.back().size() + 1)
            strings.emplace_back(s);
        if (id == kSectionStrings) {
            pack.image.strings.strings = std::move(strings);
            return;
        }
        Provenance& p = pack.image.provenance;
        std::string* const fields[] = {&p.source_name, &p.source_format, &p.source_unit,
                                       &p.source_hash, &p.tool_version,  &p.options_json};
        if (strings.size() < std::size(fields))
            fault(3129, id, fmt::format("{} strings, expected {}", strings.size(), std::size(fields)));
        else
            for (size_t i = 0; i < std::size(fields); ++i)
                *fields[i] = std::move(strings[i]);
    }

    void check_facts()
    {
        PackImage& image = pack.image;
        std::copy_n(facts_.bounds_lo_mm, 3, image.bounds_lo_mm);
        std::copy_n(facts_.bounds_hi_mm, 3, image.bounds_hi_mm);
        std::copy_n(facts_.world_origin_mm, 3, image.world_origin_mm);
        image.world_scale_mm = facts_.world_scale_mm;
        image.leaf_options = {facts_.max_turning_rad, facts_.max_aspect, facts_.max_leaves_per_patch,
                              facts_.leaf_slope_deg};
        image.trim_textures.source =
            (facts_.trim_textures & kTexturesOfMasks) != 0 ? TrimSource::Mask : TrimSource::Curve;
        image.trim_textures.layout =
            (facts_.trim_textures & kTexturesSquare) != 0 ? TrimLayout::Square : TrimLayout::Isotropic;
        if ((facts_.trim_textures & ~(kTexturesOfMasks | kTexturesSquare)) != 0)
            fault(3237, std::string(kSectionFacts), fmt::format("texture options {:#x}", facts_.trim_textures));
        if (facts_.reserved != 0)
            fault(3108, std::string(kSectionFacts), "reserved bytes are not zero");
        if (!image.compact)
            return;
        const uint64_t left = options_.max_decoded_bytes - std::min(header_.decoded_bytes, options_.max_decoded_bytes);
        if (facts_.derived_bytes > left)
            fault(3123, std::string(kSectionFacts),
                  fmt::format("{} bytes to be derived, the budget has {}", facts_.derived_bytes, left));
    }

    void derive()
    {
        PackImage& image = pack.image;
        findings = validate_image(image, watch_.cancelled);
        if (!findings.empty() || watch_.is_cancelled())
            return; // what has not been checked to its end is not to be used
        uint64_t texture_bytes = 0;
        for (const FaceRecord& f : image.faces)
            texture_bytes += 4 * texture_shape(f).words_at_most();
        if (texture_bytes > options_.max_decoded_bytes) {
            fault(3123, "FACE",
                  fmt::format("{} bytes of textures, the budget is {}", texture_bytes, options_.max_decoded_bytes));
            return;
        }
        const std::function<bool()>& cancelled = watch_.cancelled;
        derive_leaves(image, LeafOptions(image.leaf_options), cancelled);
        if (!watch_.is_cancelled())
            derive_trees(image, cancelled);
        if (!watch_.is_cancelled())
            derive_cells(image, cancelled);
        if (!watch_.is_cancelled())
            derive_sdf(image, cancelled);
    }

    const ByteSource& source_;
    const ReadOptions& options_;
    const LoadWatch& watch_;
    const bool keep_going_;
    PackHeader header_{};
    FactRecord facts_{};
    std::vector<SectionEntry> table_;
};

Error error_of(const Finding& finding, const std::string& path)
{
    constexpr int kUnsupported[] = {3105, 3121, 3122, 3125};
    Error error;
    error.code = std::find(std::begin(kUnsupported), std::end(kUnsupported), finding.number) != std::end(kUnsupported)
                     ? ErrorCode::UnsupportedPackFeature
                     : ErrorCode::InvalidPack;
    if (finding.number == 3100)
        error.code = ErrorCode::FileNotReadable;
    error.where =
        fmt::format("{}{}finding {}, section {}", path, path.empty() ? "" : ": ", finding.number, finding.section);
    error.detail = finding.detail;
    return error;
}

/// What `run` makes a decoder read of a source. Fails: the first finding.
Result<LoadedPack> decode(const ByteSource& source, const std::string& path, const ReadOptions& options,
                          const LoadWatch& watch, void (PackDecoder::*run)())
{
    PackDecoder decoder(source, options, watch, false);
    try {
        (decoder.*run)();
    } catch (const std::bad_alloc&) {
        return Error{ErrorCode::InvalidPack, path,
                     "its arrays do not fit into memory; lower the budget to be told earlier"};
    }
    if (watch.is_cancelled())
        return Error{ErrorCode::Interrupted, path, "opening was cancelled"};
    if (!decoder.findings.empty())
        return error_of(decoder.findings.front(), path);
    return std::move(decoder.pack);
}

Result<LoadedPack> decode_file(const std::string& path, const ReadOptions& options, const LoadWatch& watch,
                               void (PackDecoder::*run)())
{
    const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (descriptor < 0)
        return Error{errno == ENOENT || errno == ENOTDIR ? ErrorCode::FileNotFound : ErrorCode::FileNotReadable, path,
                     std::strerror(errno)};
    const std::unique_ptr<const int, void (*)(const int*)> closer(&descriptor, [](const int* d) { ::close(*d); });
    struct stat info;
    if (::fstat(descriptor, &info) != 0)
        return Error{ErrorCode::FileNotReadable, path, std::strerror(errno)};
    if (!S_ISREG(info.st_mode))
        return Error{ErrorCode::FileNotReadable, path, "not a regular file"};
    return decode(ByteSource(descriptor, static_cast<uint64_t>(info.st_size)), path, options, watch, run);
}

} // namespace

Result<LoadedPack> read_pack(const std::string& path, const ReadOptions& options)
{
    return read_pack(path, options, LoadWatch{});
}

Result<LoadedPack> read_pack(const std::string& path, const ReadOptions& options, const LoadWatch& watch)
{
    return decode_file(path, options, watch, &PackDecoder::run);
}

Result<StoredPreviews> read_previews(const std::string& path)
{
    Result<LoadedPack> pack = decode_file(path, {}, LoadWatch{}, &PackDecoder::run_previews);
    if (!pack.ok())
        return pack.error();
    return StoredPreviews{std::move(pack->image.preview_256_png), std::move(pack->image.preview_512_png)};
}

Result<LoadedPack> decode_pack(std::span<const std::byte> bytes, const ReadOptions& options)
{
    return decode_pack(bytes, options, LoadWatch{});
}

Result<LoadedPack> decode_pack(std::span<const std::byte> bytes, const ReadOptions& options, const LoadWatch& watch)
{
    return decode(ByteSource(bytes), "", options, watch, &PackDecoder::run);
}

std::vector<Finding> validate_pack(std::span<const std::byte> bytes)
{
    const ByteSource source(bytes);
    const ReadOptions options;
    const LoadWatch nobody;
    PackDecoder decoder(source, options, nobody, true);
    decoder.run();
    return decoder.findings;
}

} // namespace trimray
