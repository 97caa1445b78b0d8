#include "runtime/view/open_panel.h"

#include "format/pack_reader.h"
#include "runtime/image_io.h"
#include "runtime/view/widgets.h"

#include <algorithm>
#include <filesystem>
#include <system_error>

namespace trimray {
namespace {
namespace fs = std::filesystem;

/// The pack's own picture; null where it has none or cannot be read.
std::unique_ptr<GlPicture> preview_of(const std::string& pack)
{
    const Result<StoredPreviews> stored = read_previews(pack);
    if (!stored.ok() || stored->png_256.empty())
        return nullptr;
    const Result<Picture> picture = decode_png(stored->png_256);
    if (!picture.ok())
        return nullptr;
    auto out = std::make_unique<GlPicture>();
    out->set(*picture, true);
    return out;
}

/// As much of a name as fits, its end left out.
std::string fitting(std::string name, float width)
{
    if (ImGui::CalcTextSize(name.c_str()).x <= width)
        return name;
    while (!name.empty() && ImGui::CalcTextSize((name + "…").c_str()).x > width) {
        do
            name.pop_back();
        while (!name.empty() && (static_cast<unsigned char>(name.back()) & 0xc0u) == 0x80u); // whole letters
    }
    return name + "…";
}

} // namespace

void OpenPanel::list(const Viewer& viewer)
{
    listed_ = true;
    recent_.clear();
    failure_.clear();
    if (!viewer.recent_list().empty()) {
        const Result<std::vector<RecentFile>> files = read_recent_files(viewer.recent_list());
        if (!files.ok())
            failure_ = words_of(files.error());
        else
            for (const RecentFile& file : *files)
                recent_.push_back({file, preview_of(file.pack)});
    }
    std::error_code failed;
    const fs::path now = fs::current_path(failed);
    if (folder_.empty())
        list_folder_of(viewer.files().empty() ? now.string()
                                              : (now / viewer.files()[viewer.file_index()]).parent_path().string());
    else
        list_folder_of(folder_);
}

void OpenPanel::list_folder_of(const std::string& folder)
{
    Result<FolderListing> listing = list_folder(folder);
    if (!listing.ok()) {
        failure_ = words_of(listing.error());
        return;
    }
    failure_.clear();
    listing_ = std::move(*listing);
    folder_ = fs::path(folder).lexically_normal().string();
    const size_t count = std::min(folder_.size(), typed_.size() - 1);
    std::copy_n(folder_.begin(), count, typed_.begin());
    typed_[count] = 0;
}

void OpenPanel::open(Viewer& viewer, const std::string& file)
{
    viewer.panels.open = false;
    viewer.open({file});
}

void OpenPanel::draw(Viewer& viewer, bool invites, float scale)
{
    if (!listed_)
        list(viewer);
    const PictureRect& rect = viewer.picture_rect();
    const ImVec2 size{std::min(0.9f * float(rect.width), 62 * em()), std::min(0.9f * float(rect.height), 44 * em())};
    ImGui::SetNextWindowPos({float(rect.x) + 0.5f * float(rect.width), float(rect.y) + 0.5f * float(rect.height)}, 0,
                            {0.5f, 0.5f});
    ImGui::SetNextWindowSize(size);
    ImGui::SetNextWindowBgAlpha(0.96f);
    ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, {16 * scale, 12 * scale});
    ImGui::Begin("open", nullptr, kPanel);
    const ImVec2 start = ImGui::GetCursorPos();
    const float close = ImGui::GetWindowWidth() - 7 * em();
    ImGui::PushTextWrapPos(invites ? 0 : close - em());
    text(viewer.failure() ? words_of(*viewer.failure())
                          : "Drop a pack (.tray), a STEP or an IGES file here, or choose one.");
    ImGui::PopTextWrapPos();
    if (!invites) {
        const float below = ImGui::GetCursorPosY();
        ImGui::SetCursorPos({close, start.y});
        if (ImGui::Button("Close"))
            viewer.panels.open = false;
        ImGui::SetCursorPosY(std::max(below, ImGui::GetCursorPosY()));
    }
    const bool has_recent = !recent_.empty();
    if (has_recent) {
        ImGui::BeginChild("recent", {0.55f * size.x, 0});
        draw_recent(viewer, scale);
        ImGui::EndChild();
        ImGui::SameLine();
    }
    ImGui::BeginChild("folder");
    draw_folder(viewer);
    ImGui::EndChild();
    ImGui::End();
    ImGui::PopStyleVar();
}

void OpenPanel::draw_recent(Viewer& viewer, float scale)
{
    ImGui::TextDisabled("Open last");
    const float side = 8 * em(), gap = 8 * scale;
    const int columns = std::max(1, int((ImGui::GetContentRegionAvail().x + gap) / (side + gap)));
    for (size_t i = 0; i < recent_.size(); ++i) {
        const Recent& recent = recent_[i];
        if (int(i) % columns != 0)
            ImGui::SameLine(0, gap);
        ImGui::PushID(int(i));
        const ImVec2 at = ImGui::GetCursorScreenPos();
        const float high = side + 1.6f * ImGui::GetTextLineHeight();
        const bool clicked = ImGui::InvisibleButton("file", {side, high});
        ImDrawList* list = ImGui::GetWindowDrawList();
        list->AddRectFilled(at, {at.x + side, at.y + high},
                            ImGui::GetColorU32(ImGui::IsItemHovered() ? ImGuiCol_FrameBgHovered : ImGuiCol_FrameBg), 4);
        if (recent.picture)
            list->AddImage(texture_of(*recent.picture), at, {at.x + side, at.y + side});
        const std::string name = fs::path(recent.file.file).filename().string();
        list->AddText({at.x + 0.3f * em(), at.y + side}, ImGui::GetColorU32(ImGuiCol_Text),
                      fitting(name, side - 0.6f * em()).c_str());
        if (ImGui::IsItemHovered())
            ImGui::SetTooltip("%s", recent.file.file.c_str());
        if (clicked)
            open(viewer, recent.file.file);
        ImGui::PopID();
    }
}

void OpenPanel::draw_folder(Viewer& viewer)
{
    ImGui::SetNextItemWidth(-1);
    if (ImGui::InputText("##folder", typed_.data(), typed_.size(), ImGuiInputTextFlags_EnterReturnsTrue)) {
        std::error_code unknown; // then it is no folder, and opening it says what it is
        const std::string typed = typed_.data();
        if (fs::is_directory(typed, unknown))
            list_folder_of(typed);
        else
            open(viewer, typed);
        return;
    }
    if (!failure_.empty())
        ImGui::TextWrapped("%s", failure_.c_str());
    ImGui::BeginChild("entries");
    std::optional<std::string> folder, model;
    const fs::path here(folder_);
    if (here.has_parent_path() && here != here.root_path() && ImGui::Selectable(".."))
        folder = here.parent_path().string();
    for (const std::string& name : listing_.folders)
        if (ImGui::Selectable((name + "/").c_str()))
            folder = (here / name).string();
    for (const std::string& name : listing_.models)
        if (ImGui::Selectable(name.c_str()))
            model = (here / name).string();
    if (listing_.models.empty())
        ImGui::TextDisabled("no models in this folder");
    ImGui::EndChild();
    if (folder)
        list_folder_of(*folder);
    if (model)
        open(viewer, *model);
}

} // namespace trimray
