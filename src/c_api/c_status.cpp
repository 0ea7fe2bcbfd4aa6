#include "c_api/c_status.h"

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <string>
#include <string_view>

#include "codec/format/sequence.h"

namespace htvm::c_api {

using namespace internal;
namespace {

void* allocate_by_malloc(void*, std::size_t bytes) { return std::malloc(bytes); }
void release_by_free(void*, void* memory) { std::free(memory); }

}  // namespace

htvm_status status_of(ErrorKind kind) {
    switch (kind) {
        case ErrorKind::bad_input:
            return HTVM_BAD_INPUT;
        case ErrorKind::corrupt_stream:
            return HTVM_CORRUPT_STREAM;
        case ErrorKind::unsupported:
            return HTVM_UNSUPPORTED;
        case ErrorKind::limit:
            return HTVM_LIMIT;
        case ErrorKind::disk_full:
            break;
    }
    return HTVM_INTERNAL;
}

htvm_status LastError::set(htvm_status status, const char* message) {
    const std::string_view words = message;
    const std::size_t length = std::min(words.size(), text.size() - 1);
    std::copy_n(words.begin(), length, text.begin());
    text[length] = '\0';
    return status;
}

bool complete(htvm_allocator& allocator) {
    if (!allocator.allocate && !allocator.release) {
        allocator.allocate = allocate_by_malloc;
        allocator.release = release_by_free;
    }
    return allocator.allocate && allocator.release;
}

TaskRunner task_runner(htvm_run_tasks run, void* user) {
    if (!run) return {};
    return [run, user](std::size_t tasks, const std::function<void(std::size_t)>& task) {
        const auto* one = &task;
        const auto call = [](void* context, std::size_t index) { (**static_cast<decltype(one)*>(context))(index); };
        run(user, tasks, call, &one);
    };
}

htvm_status check_struct(LastError& error, StructSize size, const char* name) {
    switch (size) {
        case StructSize::good:
            return HTVM_OK;
        case StructSize::never_set:
            return error.set(HTVM_BAD_INPUT, (std::string(name) + ".struct_size was not set by its _init").c_str());
        case StructSize::from_a_later_version:
            return error.set(HTVM_UNSUPPORTED,
                             (std::string(name) + " has a member set that only a later version knows").c_str());
    }
    return HTVM_INTERNAL;
}

std::uint32_t attributes_of(const MeshView& mesh) {
    std::uint32_t out = 0;
    if (!mesh.colours.empty()) out |= HTVM_COLOURS;
    if (!mesh.normals.empty()) out |= HTVM_NORMALS;
    if (!mesh.texcoords.empty()) out |= HTVM_TEXCOORDS;
    return out;
}

static_assert(HTVM_FRAME_INTRA == static_cast<int>(FrameType::intra));
static_assert(HTVM_FRAME_ENHANCED == static_cast<int>(FrameType::enhanced));
static_assert(HTVM_FRAME_PREDICTED == static_cast<int>(FrameType::predicted));
static_assert(HTVM_FRAME_TRACKED == static_cast<int>(FrameType::tracked));
static_assert(HTVM_FRAME_PATCHED == static_cast<int>(FrameType::patched));
static_assert(HTVM_FRAME_KINDS == frame_type_count);
static_assert(HTVM_REASON_NONE == static_cast<int>(FrameReason::none));
static_assert(HTVM_REASON_DUE == static_cast<int>(FrameReason::due));
static_assert(HTVM_REASON_PATCHES == static_cast<int>(FrameReason::patches));
static_assert(HTVM_REASON_SURFACE == static_cast<int>(FrameReason::surface));
static_assert(HTVM_REASON_REGION == static_cast<int>(FrameReason::region));
static_assert(HTVM_REASON_STRAYS == static_cast<int>(FrameReason::strays));
static_assert(HTVM_REASON_BORDER == static_cast<int>(FrameReason::border));
static_assert(HTVM_REASON_TEXTURE == static_cast<int>(FrameReason::texture));
static_assert(HTVM_REASON_RATE == static_cast<int>(FrameReason::rate));
static_assert(HTVM_REASON_CUT == static_cast<int>(FrameReason::cut));
static_assert(HTVM_REASONS == frame_reasons.size());

htvm_frame_info describe(const FrameInfo& info, std::uint32_t attributes) {
    htvm_frame_info out{};
    out.attributes = attributes;
    out.type = static_cast<std::uint32_t>(info.type);
    out.frame = info.frame;
    out.sequence = info.sequence;
    out.reference = info.reference;
    out.timestamp_us = info.timestamp_us;
    out.source_vertices = info.source_vertices;
    out.source_triangles = info.source_triangles;
    out.vertices = info.vertices;
    out.triangles = info.triangles;
    out.bytes = info.bytes.total();
    out.reason = static_cast<std::uint32_t>(info.reason);
    return out;
}

}  // namespace htvm::c_api

uint32_t htvm_version() { return HTVM_VERSION_MAJOR << 16 | HTVM_VERSION_MINOR << 8 | HTVM_VERSION_PATCH; }

const char* htvm_version_string() { return "0.1.0"; }

uint32_t htvm_stream_version() { return htvm::internal::stream_version; }

const char* htvm_frame_kind_name(uint32_t type) {
    return type < htvm::frame_kinds.size() ? htvm::frame_kinds[type].name : "unknown";
}

const char* htvm_frame_kind_letter(uint32_t type) {
    return type < htvm::frame_kinds.size() ? htvm::frame_kinds[type].letter : "?";
}

const char* htvm_frame_reason_name(uint32_t reason) {
    return reason < htvm::frame_reasons.size() ? htvm::frame_reasons[reason].name : "unknown";
}

const char* htvm_status_text(htvm_status status) {
    switch (status) {
        case HTVM_OK:
            return "success";
        case HTVM_AGAIN:
            return "nothing to receive until more is sent";
        case HTVM_END:
            return "nothing more to receive";
        case HTVM_BAD_INPUT:
            return "the call or one of its arguments is invalid";
        case HTVM_CORRUPT_STREAM:
            return "the stream is corrupt";
        case HTVM_UNSUPPORTED:
            return "not supported by this version";
        case HTVM_LIMIT:
            return "larger than a configured limit";
        case HTVM_OUT_OF_MEMORY:
            return "there is not enough memory";
        case HTVM_BUFFER_TOO_SMALL:
            return "the caller's array is too short";
        case HTVM_INTERNAL:
            return "a bug in the library";
        default:
            return "not a status of this version";
    }
}
