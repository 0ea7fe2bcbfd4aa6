/* htvm: compression of human time-varying meshes. The C interface: plain C99, opaque handles, no exceptions.
 *
 * Decoding a stream that comes in pieces (examples/decode.c is a whole program):
 *
 *   htvm_decoder *decoder = NULL;
 *   if (htvm_decoder_create(NULL, &decoder) != HTVM_OK) return 1;
 *   while (there are bytes) {
 *       htvm_decoder_send_bytes(decoder, bytes, count);
 *       htvm_frame_info info;
 *       htvm_status status;
 *       while ((status = htvm_decoder_receive_frame(decoder, &info, sizeof info)) != HTVM_AGAIN) {
 *           if (status == HTVM_BAD_INPUT) return 1;               a wrong call, which repeating would not mend
 *           if (status != HTVM_OK) { puts(htvm_decoder_last_error(decoder)); continue; }     a packet is lost
 *           htvm_decoder_view(decoder, &view, sizeof view);      or htvm_decoder_copy_positions(...) and its like
 *       }
 *   }
 *   htvm_decoder_destroy(decoder);
 *
 * Encoding (examples/encode.c):
 *
 *   htvm_encoder_options_create(HTVM_PROFILE_TRACKED, NULL, &options);
 *   htvm_encoder_options_set(options, "key_interval", "60");
 *   if (htvm_encoder_create(options, &encoder, problem, sizeof problem) != HTVM_OK) return 1;
 *   htvm_encoder_send_mesh(encoder, &mesh, &pose, timestamp_us, 0);
 *   while (htvm_encoder_receive_packet(encoder, buffer, sizeof buffer, &size) == HTVM_OK) store(buffer, size);
 *   htvm_encoder_finish(encoder);                                   then receive the rest, up to HTVM_END
 *
 * Conventions
 * - Lengths are millimetres, times microseconds, rotations row-major 3x3 matrices. Arrays are packed: x y z x y z ...
 * - A capacity is the number of elements (not bytes, not vertices) that the array has room for.
 * - Structs begin with struct_size, so that later versions can extend them. A struct that the caller fills gets its
 *   defaults from its _init function, called with sizeof the struct (a size that no version has is refused later). A
 *   function that fills a struct takes its sizeof as another argument.
 * - A handle may be used by one thread at a time; different threads may use different handles at the same time.
 * - Functions that take a handle return HTVM_BAD_INPUT if it is NULL; _destroy accepts NULL and does nothing.
 * - No C++ exception leaves these functions. (A WebAssembly build has no exceptions: if memory runs out, it traps.)
 * - In C++ programs the header is htvm/htvm.hpp.
 */
#ifndef HTVM_HTVM_H
#define HTVM_HTVM_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- versions ------------------------------------------------------------------------------------------------- */

#define HTVM_VERSION_MAJOR 0 /* of this header */
#define HTVM_VERSION_MINOR 1
#define HTVM_VERSION_PATCH 0

/* Version of the linked library: major * 65536 + minor * 256 + patch, and as text, "0.1.0". */
uint32_t htvm_version(void);
const char* htvm_version_string(void);
/* Version of the streams that it writes where T-frames do not come in groups; it reads all up to 5 (docs/bitstream.md).
 */
uint32_t htvm_stream_version(void);

/* ---- status --------------------------------------------------------------------------------------------------- */

typedef int32_t htvm_status; /* one of: */
enum {
    HTVM_OK = 0,
    HTVM_AGAIN = 1,             /* nothing to receive until more is sent; when sending: receive first */
    HTVM_END = 2,               /* nothing more to receive */
    HTVM_BAD_INPUT = -1,        /* invalid call: NULL, an option or mesh out of range, calls in the wrong order */
    HTVM_CORRUPT_STREAM = -2,   /* the stream is inconsistent or ends too early */
    HTVM_UNSUPPORTED = -3,      /* valid, but not supported by this version */
    HTVM_LIMIT = -4,            /* larger than a configured limit */
    HTVM_OUT_OF_MEMORY = -5,    /* an allocation failed */
    HTVM_BUFFER_TOO_SMALL = -6, /* the caller's array is too short; nothing was written */
    HTVM_INTERNAL = -7          /* a bug in the library: please report it */
};

/* A short description of the status, never NULL. */
const char* htvm_status_text(htvm_status status);

/* ---- memory --------------------------------------------------------------------------------------------------- */

/* Allocates the memory of a handle, which is all that this interface itself allocates. Both functions NULL: malloc and
 * free. It is not used for the codec's own data (meshes, tables, packets being processed): that is allocated by C++'s
 * operator new, which a program may replace, and for a decoder is limited by htvm_decoder_options.max_memory. */
typedef struct htvm_allocator {
    void* user;                                  /* passed to the functions */
    void* (*allocate)(void* user, size_t bytes); /* must align like malloc; NULL: out of memory */
    void (*release)(void* user, void* memory);   /* memory is never NULL */
} htvm_allocator;

/* ---- threads -------------------------------------------------------------------------------------------------- */

/* Runs tasks on the caller's threads: must call task(context, 0), ..., task(context, tasks - 1), each once, on any
 * threads and in any order, and return when all have returned. No task needs another to run at the same time. It may be
 * called from several threads at once, when tasks have tasks of their own. user is the pointer given with the function.
 */
typedef void (*htvm_run_tasks)(void* user, size_t tasks, void (*task)(void* context, size_t index), void* context);

/* ---- frames --------------------------------------------------------------------------------------------------- */

/* type of a frame */
enum {
    HTVM_FRAME_INTRA = 0,     /* a complete mesh by itself */
    HTVM_FRAME_ENHANCED = 1,  /* against the last I-frame, with connectivity of its own */
    HTVM_FRAME_PREDICTED = 2, /* the last I-frame's mesh moved */
    HTVM_FRAME_TRACKED = 3,   /* the reference's mesh laid on the captured surface */
    HTVM_FRAME_PATCHED = 4,   /* the same, with a part replaced: a new reference */
    HTVM_FRAME_KINDS = 5      /* number of types in this version */
};

/* Name of a type: "intra" and "I", "enhanced" and "EP", "predicted" and "P", "tracked" and "T", "patched" and "TP";
 * "unknown" and "?" for a number that this version does not know. Never NULL. */
const char* htvm_frame_kind_name(uint32_t type);
const char* htvm_frame_kind_letter(uint32_t type);

/* why the encoder sent an I- or TP-frame where a smaller one might have done */
enum {
    HTVM_REASON_NONE = 0,    /* it is not told, as of the first frame */
    HTVM_REASON_DUE = 1,     /* the longest key interval has passed, the caller asks for it, or there is nothing to
                              * refer to */
    HTVM_REASON_PATCHES = 2, /* whoever joins late would need too many patches */
    HTVM_REASON_SURFACE = 3, /* the reference fits worse than it could, over all the surface */
    HTVM_REASON_REGION = 4,  /* the reference does not fit in one region, such as a hand */
    HTVM_REASON_STRAYS = 5,  /* too much of the surface is far from the reference */
    HTVM_REASON_BORDER = 6,  /* surface was captured that the reference does not have */
    HTVM_REASON_TEXTURE = 7, /* the capture's texture atlas is laid out anew */
    HTVM_REASON_RATE = 8,    /* a frame that refers to another would take more bits */
    HTVM_REASON_CUT = 9,     /* the picture would fall apart: a cut, or another person */
    HTVM_REASONS = 10        /* number of reasons in this version */
};

/* Name of a reason: "none", "due", ...; "unknown" for a number that this version does not know. Never NULL. */
const char* htvm_frame_reason_name(uint32_t reason);

/* attributes of a mesh besides positions: bits */
/* HTVM_MOVING_TEXCOORDS: a decoded frame's texture coordinates are a camera's projection of its positions, and so
 * others in each frame, whatever its topology. */
enum { HTVM_COLOURS = 1, HTVM_NORMALS = 2, HTVM_TEXCOORDS = 4, HTVM_MOVING_TEXCOORDS = 8 };

typedef struct htvm_frame_info {
    uint32_t struct_size; /* number of bytes of this struct that were filled in */
    uint32_t type;        /* HTVM_FRAME_... */
    uint32_t frame;       /* its number, from 0 */
    uint32_t reference;   /* number of the frame that it refers to; for an I-frame, its own */
    int64_t timestamp_us;
    uint32_t source_vertices, source_triangles; /* of the captured mesh */
    uint32_t vertices, triangles;               /* of the decoded mesh */
    uint32_t attributes;                        /* HTVM_COLOURS | ... */
    uint32_t joints, bones;                     /* of its pose */
    uint32_t concealed;                         /* 1: from htvm_decoder_conceal() */
    uint64_t bytes;                             /* of its packet */
    uint32_t topology; /* frames of a decoder with the same number have the same triangles, and but for
                          HTVM_MOVING_TEXCOORDS the same texture coordinates; 0 from an encoder */
    uint32_t sequence; /* which sequence of the stream it belongs to, as in htvm_sequence_info; 0 from an encoder */
    uint32_t reference_topology; /* frames of a decoder with the same number have the same vertices at the same places
                                    of the arrays, and but for HTVM_MOVING_TEXCOORDS the same texture coordinates. It is
                                    the topology of a frame that
                                    shows all of the mesh; one that shows a part has another topology, and its triangles
                                    are those whose three vertices are there. 0 from an encoder */
    uint32_t absent;   /* how many vertices are not there, as htvm_mesh_view.presence says; 0 from an encoder */
    uint32_t reason;   /* HTVM_REASON_... */
    uint32_t reserved; /* 0 */
} htvm_frame_info;

/* ---- decoder -------------------------------------------------------------------------------------------------- */

typedef struct htvm_decoder htvm_decoder;

typedef struct htvm_decoder_options {
    uint32_t struct_size; /* set by htvm_decoder_options_init() */
    uint32_t threads;     /* that work at the same time; 0: one per core. The meshes are the same for any number.
                           * Default: 0 */
    /* A frame larger than this is refused with HTVM_LIMIT before memory is allocated for it. */
    uint32_t max_vertices;     /* of a frame. Default: 2^22 */
    uint32_t max_triangles;    /* of a frame. Default: 2^23 */
    uint32_t max_joints;       /* of the skeleton; the format allows no more. Default: 1024 */
    uint32_t max_bones;        /* likewise. Default: 1024 */
    uint64_t max_packet_bytes; /* larger packets in a stream sent as bytes are treated as damage. Default: 2^28 */
    uint64_t max_memory;       /* bytes, checked against an upper bound for what is kept and the frame being decoded.
                                * Default: 2^32 */
    htvm_allocator allocator;  /* Default: malloc and free */
    htvm_run_tasks run_tasks;  /* provides the threads. NULL, the default: a pool of the decoder's own, whose threads
                                * stay */
    void* run_tasks_user;      /* for run_tasks */
    uint32_t detail_levels;    /* how many levels of detail are shown below the mesh that frames refer to, where a
                                * stream has any; with fewer, frames take less time. Default: 9, all */
} htvm_decoder_options;

/* Sets the first struct_size bytes of options to the defaults above. HTVM_BAD_INPUT if struct_size is less than 8. */
htvm_status htvm_decoder_options_init(htvm_decoder_options* options, size_t struct_size);

/* Makes a decoder. options: NULL for the defaults. *decoder is set to NULL unless the status is HTVM_OK. Errors:
 * HTVM_BAD_INPUT (one allocator function without the other, a struct_size that no init set), HTVM_UNSUPPORTED (an
 * option that only a later version knows), HTVM_OUT_OF_MEMORY. */
htvm_status htvm_decoder_create(const htvm_decoder_options* options, htvm_decoder** decoder);
void htvm_decoder_destroy(htvm_decoder* decoder);

/* The message of the last failed call on this handle: one sentence, or "" if none has failed. Valid until the next call
 * on the handle. For a NULL handle: "". */
const char* htvm_decoder_last_error(const htvm_decoder* decoder);

/* Sends one whole packet (header, payload and checksums, as the encoder returns it), for transports that keep packets
 * apart; the bytes are copied. HTVM_AGAIN: the previous packet must be received first; this one was not taken.
 * HTVM_CORRUPT_STREAM: not exactly one undamaged packet, or larger than max_packet_bytes. HTVM_BAD_INPUT also after
 * htvm_decoder_send_bytes(): a decoder accepts only one of the two. */
htvm_status htvm_decoder_send_packet(htvm_decoder* decoder, const uint8_t* packet, size_t size);

/* Sends the next piece, of any size, of a .htvm stream; the bytes are copied. Damage costs only the packets that it
 * touches: the decoder continues at the next whole one. Receive all frames after each call, or bytes accumulate.
 * HTVM_OUT_OF_MEMORY: none of the bytes was taken. */
htvm_status htvm_decoder_send_bytes(htvm_decoder* decoder, const uint8_t* bytes, size_t size);

/* Decodes up to the next frame, which becomes the current one, and reports its type and sizes. info: may be NULL.
 * HTVM_AGAIN: no frame until more is sent. HTVM_CORRUPT_STREAM, HTVM_UNSUPPORTED, HTVM_LIMIT (also if decoding ran out
 * of memory): a packet could not be decoded and was skipped; call again for those after it. HTVM_OUT_OF_MEMORY: not
 * even a packet could be read; what was sent and not received is discarded. After any failure there is no current
 * frame. Every call, except one that returns HTVM_BAD_INPUT, consumes some of what was sent, so a loop until HTVM_AGAIN
 * always ends. */
htvm_status htvm_decoder_receive_frame(htvm_decoder* decoder, htvm_frame_info* info, size_t info_size);

/* Makes the current frame a stand-in for one that did not arrive or could not be decoded: the last I-frame's mesh,
 * moved as in the last frame. frame, timestamp_us: those of the missing frame. HTVM_AGAIN before any I-frame. */
htvm_status htvm_decoder_conceal(htvm_decoder* decoder, uint32_t frame, int64_t timestamp_us, htvm_frame_info* info,
                                 size_t info_size);

/* Derives now what the next frame will need of the last one, where that takes long, as behind an I- or TP-frame: for
 * callers with time to spare between two frames. It changes no frame, and the current one stays. It may be left out;
 * the next frame then takes longer. */
htvm_status htvm_decoder_prepare(htvm_decoder* decoder);

/* Sets htvm_decoder_options::detail_levels for the frames to come; the current one stays. The frames then have another
 * topology. */
htvm_status htvm_decoder_set_detail_levels(htvm_decoder* decoder, uint32_t levels);

/* Discards what was sent and not received, e.g. for a seek. The sequence header and the last I-frame are kept. */
htvm_status htvm_decoder_discard(htvm_decoder* decoder);

/* The number of bytes skipped as damage so far, and of bytes that do not form a whole packet yet: at the end of a
 * stream, a truncated packet. Either may be NULL. Both are 0 with htvm_decoder_send_packet(). */
htvm_status htvm_decoder_unused_bytes(const htvm_decoder* decoder, uint64_t* damaged, uint64_t* pending);

/* The arrays of the current frame, on loan: they are not copied, and stay valid until the next call to receive or
 * conceal on the decoder, or until it is destroyed. */
typedef struct htvm_mesh_view {
    uint32_t struct_size; /* number of bytes of this struct that were filled in */
    uint32_t vertices, triangles;
    uint32_t topology;       /* as in htvm_frame_info: if it equals the last frame's, so do indices, and but for
                                HTVM_MOVING_TEXCOORDS texcoords */
    const float* positions;  /* mm, 3 per vertex */
    const uint32_t* indices; /* 3 per triangle, counter-clockwise seen from outside */
    const uint8_t* colours;  /* red, green, blue per vertex; NULL: the frame has none */
    const float* normals;    /* 3 per vertex, unit length; or NULL */
    const float* texcoords;  /* 2 per vertex, or NULL */
    const uint8_t* presence; /* 1 per vertex: 1, or 0 where it is not there. No triangle names such a vertex, and its
                              * position is a guess at what nobody saw. NULL: all are there, as in streams before
                              * version 7 */
} htvm_mesh_view;

/* HTVM_BAD_INPUT: there is no current frame, or view_size is not sizeof(htvm_mesh_view). */
htvm_status htvm_decoder_view(htvm_decoder* decoder, htvm_mesh_view* view, size_t view_size);

/* Copy an array of the current frame into the caller's. HTVM_BAD_INPUT: there is no current frame, or it does not have
 * this attribute. HTVM_BUFFER_TOO_SMALL: capacity is less than stated behind each function. A NULL array is allowed if
 * there is nothing to copy. */
htvm_status htvm_decoder_copy_positions(htvm_decoder* decoder, float* positions, size_t capacity);  /* 3 per vertex */
htvm_status htvm_decoder_copy_triangles(htvm_decoder* decoder, uint32_t* indices, size_t capacity); /* 3 per triangle */
htvm_status htvm_decoder_copy_colours(htvm_decoder* decoder, uint8_t* rgb, size_t capacity);        /* 3 per vertex */
htvm_status htvm_decoder_copy_normals(htvm_decoder* decoder, float* normals, size_t capacity);      /* 3 per vertex */
htvm_status htvm_decoder_copy_texcoords(htvm_decoder* decoder, float* texcoords, size_t capacity);  /* 2 per vertex */
htvm_status htvm_decoder_copy_joints(htvm_decoder* decoder, double* joints, size_t capacity);       /* 3 per joint */
htvm_status htvm_decoder_copy_orientations(htvm_decoder* decoder, double* rotations, size_t capacity); /* 9 per bone */

/* where the subject's head is */
enum {
    HTVM_UP_UNKNOWN = 0,
    HTVM_UP_X = 1,
    HTVM_UP_MINUS_X = 2,
    HTVM_UP_Y = 3,
    HTVM_UP_MINUS_Y = 4,
    HTVM_UP_Z = 5,
    HTVM_UP_MINUS_Z = 6
};

/* Where texture coordinates come from: none, as captured, the stream's own charts, one camera's projection. */
enum { HTVM_TEXTURE_NONE = 0, HTVM_TEXTURE_CAPTURED = 1, HTVM_TEXTURE_CHARTS = 2, HTVM_TEXTURE_PROJECTION = 3 };

typedef struct htvm_sequence_info {
    uint32_t struct_size; /* number of bytes of this struct that were filled in */
    uint32_t joints, bones;
    uint32_t skeleton_tracked;               /* 0: the capture has no skeleton, and one bone stands in for it */
    uint32_t fps_numerator, fps_denominator; /* frames per second */
    uint32_t unit_micrometres;               /* the unit in which the capture was given */
    uint32_t nearest_vertices;               /* m of the distance order */
    double lattice_step;                     /* mm: decoded positions are the origin plus multiples of this */
    uint64_t session;                        /* of the live publisher, drawn anew for each run; 0: none */
    uint32_t sequence;                       /* which sequence of the stream it is, from 0: joined files are several */
    uint32_t stream_version;                 /* of the stream, as htvm_stream_version() is of the library */
    uint32_t up;                             /* HTVM_UP_... */
    uint32_t floor_known;                    /* 1: floor is */
    double floor;                            /* mm: the floor's coordinate on the axis that is up */
    uint32_t metadata;                       /* how many entries htvm_decoder_metadata() has */
    uint32_t texture_layout;                 /* HTVM_TEXTURE_... */
    uint32_t texture_width, texture_height;  /* of the texture's pictures, pixels; 0 without one */
} htvm_sequence_info;

/* The contents of the sequence header. HTVM_AGAIN until one was decoded. */
htvm_status htvm_decoder_sequence(htvm_decoder* decoder, htvm_sequence_info* info, size_t info_size);

/* The joint's name in UTF-8, terminated by a 0. HTVM_BUFFER_TOO_SMALL below its length + 1; 256 is always enough. */
htvm_status htvm_decoder_joint_name(htvm_decoder* decoder, uint32_t joint, char* name, size_t capacity);

/* The two joints of the bone, first the one that it turns about, and its radius in mm. Each pointer may be NULL. */
htvm_status htvm_decoder_bone(htvm_decoder* decoder, uint32_t bone, uint32_t* first, uint32_t* second, double* radius);

/* An entry of the metadata: a key and a value in UTF-8, each terminated by a 0. HTVM_BUFFER_TOO_SMALL below their
 * lengths + 1; 256 for keys and 4096 for values is always enough. Players know the keys "title", "rights" and
 * "timecode". */
htvm_status htvm_decoder_metadata(htvm_decoder* decoder, uint32_t entry, char* key, size_t key_capacity, char* value,
                                  size_t value_capacity);

/* Writes three numbers: what was taken off the capture's x, y and z, mm. Added to decoded positions, as doubles, it
 * gives the capture's own back. Zeros as a rule. HTVM_AGAIN until a sequence header was decoded. */
htvm_status htvm_decoder_global_shift(htvm_decoder* decoder, int64_t* shift);

/* Where the current frame's bytes went: bytes[0] headers, counts and checksums, bytes[n] the layer of number n
 * (docs/bitstream.md, section 4). HTVM_LAYERS numbers are always enough. HTVM_BAD_INPUT: there is no current frame.
 * HTVM_BUFFER_TOO_SMALL below HTVM_LAYERS. */
enum { HTVM_LAYERS = 20 };
htvm_status htvm_decoder_layer_bytes(htvm_decoder* decoder, uint64_t* bytes, size_t capacity);
/* What people call layer n: "geometry"; "overhead" for 0. NULL where there is no such layer. */
const char* htvm_layer_name(uint32_t layer);

/* ---- what a frame needs --------------------------------------------------------------------------------------- */

/* flags of a packet: bits */
enum {
    HTVM_PACKET_REFERRED = 1,     /* of a frame or picture: later ones may refer to it */
    HTVM_PACKET_ACCESS = 2,       /* of a frame: it needs no frame but the one it refers to, which needs none; of a
                                   * picture: it needs no other */
    HTVM_PACKET_DROPPABLE = 4,    /* of a frame or picture: it may be left out without affecting any other */
    HTVM_PACKET_COLOUR = 8,       /* of a codebook: of the colours, not of the geometry */
    HTVM_PACKET_SESSION = 16,     /* of a sequence header: its session is not 0 */
    HTVM_PACKET_FLAGS_VALID = 128 /* the other bits are valid */
};

typedef struct htvm_packet_info {
    uint32_t struct_size; /* bytes of this struct that were filled */
    uint32_t kind;        /* of packet: docs/bitstream.md, section 2; HTVM_PACKET_PICTURE, ... */
    uint32_t flags;       /* HTVM_PACKET_...; for streams of version 1 they are derived */
    uint32_t frame;       /* number of the frame that it is, or came with */
    uint32_t reference;   /* number of the frame that it refers to */
    uint32_t reference_version;
    int64_t timestamp_us;
    uint64_t bytes; /* of the whole packet */
} htvm_packet_info;

/* Reads the header of a whole packet. HTVM_CORRUPT_STREAM: it is not one whole, undamaged packet. */
htvm_status htvm_packet_read(const uint8_t* packet, size_t size, htvm_packet_info* info, size_t info_size);

/* The same from the first HTVM_PACKET_HEADER bytes of a packet alone, for programs that go from packet to packet in a
 * file. HTVM_AGAIN: there are fewer bytes. HTVM_CORRUPT_STREAM: no undamaged header begins here. Whether what follows
 * is undamaged is not known. In streams of version 1, flags lack HTVM_PACKET_FLAGS_VALID: only htvm_packet_read()
 * derives them. */
enum { HTVM_PACKET_HEADER = 32 };
htvm_status htvm_packet_header_read(const uint8_t* bytes, size_t size, htvm_packet_info* info, size_t info_size);

/* kinds of packets that players look for; all others go to the decoder, and these may */
enum { HTVM_PACKET_AUDIO = 10, HTVM_PACKET_PICTURE = 12 };

/* what coded a picture */
enum {
    HTVM_PICTURE_AV1 = 1,  /* one temporal unit of low-overhead OBUs */
    HTVM_PICTURE_VP9 = 2,  /* one frame */
    HTVM_PICTURE_H264 = 3, /* one access unit, each NAL unit behind its size in four bytes */
    HTVM_PICTURE_PNG = 16, /* image files */
    HTVM_PICTURE_JPEG = 17,
    HTVM_PICTURE_WEBP = 18
};

/* The picture of a frame of a textured stream, to be given to the platform's decoder of video or images. */
typedef struct htvm_texture_picture {
    uint32_t struct_size;          /* number of bytes of this struct that were filled in */
    uint32_t coder;                /* HTVM_PICTURE_... */
    uint32_t matrix;               /* of video: 1 BT.709, 6 BT.601; 0 of image files */
    uint32_t full_range;           /* of video: 1 where its planes take the whole range of 0..255 */
    uint32_t width, height;        /* pixels, 1..4096 */
    uint32_t frame;                /* number of the frame that it is the picture of */
    uint32_t reference;            /* number of the frame of the picture before, which it needs; its own frame's for a
                                    * key picture, which needs none */
    int64_t timestamp_us;          /* of its frame */
    uint32_t gain_red, gain_green; /* the decoded values, 0..255, are multiplied by these / 4096 */
    uint32_t gain_blue;
    uint32_t reserved;    /* 0 */
    const uint8_t* coded; /* the coder's bytes, on loan: within the packet */
    uint64_t coded_bytes; /* at least 1 */
} htvm_texture_picture;

/* Reads a whole packet of kind HTVM_PACKET_PICTURE (header and checksums included). HTVM_CORRUPT_STREAM: it is not one
 * whole, undamaged packet of this kind. HTVM_UNSUPPORTED: the coder or the matrix is not known. HTVM_BAD_INPUT also if
 * picture_size is not sizeof(htvm_texture_picture). */
htvm_status htvm_texture_picture_read(const uint8_t* packet, size_t size, htvm_texture_picture* picture,
                                      size_t picture_size);

/* Determines what frames need, for programs that forward, record or cut a stream without decoding it. */
typedef struct htvm_dependencies htvm_dependencies;

/* allocator: NULL for malloc and free. *dependencies is set to NULL unless the status is HTVM_OK. */
htvm_status htvm_dependencies_create(const htvm_allocator* allocator, htvm_dependencies** dependencies);
void htvm_dependencies_destroy(htvm_dependencies* dependencies);

/* Takes the next packet of a stream, as htvm_packet_read() gives it. *place, which may be NULL, is set to 0 for the
 * first packet, and so on. */
htvm_status htvm_dependencies_push(htvm_dependencies* dependencies, const htvm_packet_info* info, uint64_t* place);

/* The places of exactly the packets that the newest frame needs (no picture is), in the order to decode them, itself
 * last; none if it cannot be decoded. *count is set to how many; HTVM_BUFFER_TOO_SMALL if capacity is less. */
htvm_status htvm_dependencies_closure(htvm_dependencies* dependencies, uint64_t* places, size_t capacity,
                                      size_t* count);
/* Likewise what later frames may need, and later pictures of a textured stream. All other packets can be forgotten; a
 * viewer that joins late is sent these. */
htvm_status htvm_dependencies_kept(htvm_dependencies* dependencies, uint64_t* places, size_t capacity, size_t* count);

/* The number in the whole stream of the frame that the packet pushed last is. Where the frame numbers of a sequence
 * start again, its frames are numbered on from the sequence before. HTVM_AGAIN: the packet is no frame. */
htvm_status htvm_dependencies_frame(htvm_dependencies* dependencies, uint32_t* frame);

/* ---- index ---------------------------------------------------------------------------------------------------- */

/* A place where decoding can start, once the sequence header and the frames that it refers to are known. */
typedef struct htvm_index_entry {
    int64_t timestamp_us;
    uint64_t offset; /* of its packet, bytes from the start of the stream */
    uint32_t frame;
    uint32_t back;     /* how many entries before this one is the frame that it refers to; 0: it refers to nothing */
    uint32_t flags;    /* of its packet: HTVM_PACKET_...; 0 in an index at the end, which does not tell them */
    uint32_t reserved; /* 0 */
} htvm_index_entry;

/* What an index packet, header and checksums included, says; for players that seek. Of kind 5, at the end of a stream,
 * or of kind 8, in front: then it must be the first packet of the stream. *count is set to its number of entries;
 * HTVM_BUFFER_TOO_SMALL where capacity is less, and nothing is written (so a capacity of 0 asks for the number).
 * HTVM_CORRUPT_STREAM: not one whole, undamaged index packet. Frames and timestamps are what the stream says: check
 * them against the packets found there.
 *
 * To show frame n: of the entries at or before n, take the last with HTVM_PACKET_REFERRED, or where none has it, the
 * last. Send the decoder the packets of the entries that it refers to, `back` by `back`, the earliest first, then its
 * own packet and all that follow. */
htvm_status htvm_index_read(const uint8_t* packet, size_t size, htvm_index_entry* entries, size_t capacity,
                            size_t* count);

/* ---- encoder -------------------------------------------------------------------------------------------------- */

typedef struct htvm_encoder htvm_encoder;

/* The purpose of the stream: which frames come between the I-frames. */
enum {
    HTVM_PROFILE_TRACKED = 0,  /* the fewest bits: T-frames, where the I-frame's mesh is laid on each frame's surface */
    HTVM_PROFILE_TOPOLOGY = 1, /* every frame keeps its own connectivity: EP-frames, or I-frames if they cost less */
    HTVM_PROFILE_PAPER = 2     /* the same with the choices of the published method */
};

/* The skeleton, constant over the sequence. htvm_encoder_options_set_skeleton() copies all arrays. */
typedef struct htvm_skeleton {
    uint32_t struct_size;           /* set by htvm_skeleton_init() */
    uint32_t joints, bones;         /* 0, 0: the capture has no skeleton */
    const uint16_t* bone_joints;    /* 2 per bone: the joint that it turns about, and the other one */
    const char* const* joint_names; /* one per joint, UTF-8, or NULL */
    const double* radii;            /* mm, one per bone, or NULL: calibrated on the first frame */
} htvm_skeleton;

/* The options of an encoder. Numbers, words and switches are set by name; docs/options.md lists them, and so does
 * htvm_encoder_option(). */
typedef struct htvm_encoder_options htvm_encoder_options;

/* Makes the options of a profile, with their defaults. allocator: NULL for malloc and free; copied, and also used for
 * the encoders made with these options. *options is set to NULL unless the status is HTVM_OK. Errors: HTVM_BAD_INPUT
 * (no such profile, one allocator function without the other), HTVM_OUT_OF_MEMORY. */
htvm_status htvm_encoder_options_create(uint32_t profile, const htvm_allocator* allocator,
                                        htvm_encoder_options** options);
void htvm_encoder_options_destroy(htvm_encoder_options* options);

/* As htvm_decoder_last_error(). */
const char* htvm_encoder_options_last_error(const htvm_encoder_options* options);

/* Sets an option, such as "key_interval" to "60" or 60, "topology.frame_choice" to "motion" or its index in the list of
 * words, "topology.scene_changes" to "off" or 0. Numbers in text use a decimal point, whatever the locale.
 * HTVM_BAD_INPUT: there is no such option (the last error names the most similar one), or the value is out of range;
 * nothing is changed then. htvm_encoder_create() checks whether options fit together. */
htvm_status htvm_encoder_options_set(htvm_encoder_options* options, const char* name, const char* value);
htvm_status htvm_encoder_options_set_number(htvm_encoder_options* options, const char* name, double value);

/* The value of an option, as text terminated by a 0 (HTVM_BUFFER_TOO_SMALL below its length + 1; 32 is always enough)
 * or as a number. */
htvm_status htvm_encoder_options_get(htvm_encoder_options* options, const char* name, char* value, size_t capacity);
htvm_status htvm_encoder_options_get_number(htvm_encoder_options* options, const char* name, double* value);

/* Copies the skeleton. NULL, the default: the capture has none. */
htvm_status htvm_encoder_options_set_skeleton(htvm_encoder_options* options, const htvm_skeleton* skeleton);

/* Adds an entry to the metadata that every sequence header carries; both in UTF-8. Keys that players know: "title",
 * "rights", "timecode" (of the first frame, HH:MM:SS:FF), "front" (from the subject to whoever sees it from the front:
 * three numbers, "0 0 -1"). Limits, checked by htvm_encoder_create(): 255 entries, 255 bytes a key, 4095 a value, 16384
 * in all. */
htvm_status htvm_encoder_options_add_metadata(htvm_encoder_options* options, const char* key, const char* value);

/* Says where the floor is, mm: its coordinate on the axis that the option "up" names. */
htvm_status htvm_encoder_options_set_floor(htvm_encoder_options* options, double floor);

/* Says what the caller took off the capture's x, y and z before they became floats: three numbers, mm, each below 2^53
 * either way; the stream keeps it for htvm_decoder_global_shift(). */
htvm_status htvm_encoder_options_set_global_shift(htvm_encoder_options* options, const int64_t* shift);

/* Provides the encoder's threads, of which it uses at most as many at once as the option "threads" says. NULL, the
 * default: a pool of the encoder's own. user is passed to run_tasks. */
htvm_status htvm_encoder_options_set_run_tasks(htvm_encoder_options* options, htvm_run_tasks run_tasks, void* user);

/* kind of an option's value */
enum {
    HTVM_OPTION_NUMBER = 0,
    HTVM_OPTION_WHOLE_NUMBER = 1,
    HTVM_OPTION_SWITCH = 2, /* "on" or "off", 1 or 0 */
    HTVM_OPTION_WORD = 3    /* one of htvm_encoder_option_word() */
};

/* Everything about an option. The texts belong to the library and are never NULL. */
typedef struct htvm_option_info {
    uint32_t struct_size; /* number of bytes of this struct that were filled in */
    uint32_t kind;        /* HTVM_OPTION_... */
    const char* name;     /* "tracked.node_spacing" */
    const char* group;    /* "common", "rate"; "tracked", "topology": for these profiles only (paper: topology) */
    const char* unit;     /* "mm", "frames"; "": none */
    const char* meaning;  /* in one line */
    const char* zero;     /* what 0 means, if it has a special meaning: then it is allowed besides the range */
    double least, most;   /* range, both ends allowed */
    double default_value; /* in the requested profile */
    uint32_t words;       /* number of words; 0 for other kinds */
    uint32_t serves;      /* 1: it has an effect in the profile; 0: it must stay at its default */
} htvm_option_info;

/* Options are numbered from 0 to htvm_encoder_option_count() - 1; the numbers may differ in another version.
 * HTVM_BAD_INPUT: no such option or profile, or info is NULL. */
uint32_t htvm_encoder_option_count(void);
htvm_status htvm_encoder_option(uint32_t option, uint32_t profile, htvm_option_info* info, size_t info_size);
/* NULL if there is no such word. */
const char* htvm_encoder_option_word(uint32_t option, uint32_t word);

/* A frame to code. Attributes that the mesh does not have are NULL. The only requirement on triangles is that their
 * indices are below `vertices`. */
typedef struct htvm_mesh {
    uint32_t struct_size; /* set by htvm_mesh_init() */
    uint32_t vertices, triangles;
    uint32_t reserved;       /* 0 */
    const float* positions;  /* mm, 3 per vertex */
    const uint32_t* indices; /* 3 per triangle, counter-clockwise seen from outside */
    const uint8_t* colours;  /* red, green, blue per vertex */
    const float* normals;    /* 3 per vertex, unit length */
    const float* texcoords;  /* 2 per vertex */
} htvm_mesh;

/* The skeleton in this frame. */
typedef struct htvm_pose {
    uint32_t struct_size;       /* set by htvm_pose_init() */
    uint32_t reserved;          /* 0 */
    const double* joints;       /* mm, 3 per joint of the skeleton */
    const double* orientations; /* 9 per bone, or NULL: derived from the joints */
    const uint8_t* tracked;     /* one per joint, 0: the position is a guess; NULL: all are tracked */
} htvm_pose;

/* Set the first struct_size bytes to 0, except struct_size itself. */
htvm_status htvm_skeleton_init(htvm_skeleton* skeleton, size_t struct_size);
htvm_status htvm_mesh_init(htvm_mesh* mesh, size_t struct_size);
htvm_status htvm_pose_init(htvm_pose* pose, size_t struct_size);

/* The steps of a quality, to which the option "quality" sets them: 16 mm at 0, 2 mm at 50, 0.25 mm at 100; values
 * outside of 0..100 are clamped. Either pointer may be NULL. */
void htvm_quality_steps(double quality, double* geometry_step, double* colour_step);

/* Makes an encoder. options: NULL for the defaults of the tracked profile, which make the stream that `htvm encode`
 * makes; they are copied. *encoder is set to NULL unless the status is HTVM_OK. Errors: HTVM_BAD_INPUT (options
 * contradict each other or the skeleton; text, if not NULL, receives an explanation of up to text_capacity characters,
 * including the terminating 0), HTVM_OUT_OF_MEMORY. */
htvm_status htvm_encoder_create(const htvm_encoder_options* options, htvm_encoder** encoder, char* text,
                                size_t text_capacity);
void htvm_encoder_destroy(htvm_encoder* encoder);

/* As htvm_decoder_last_error(). */
const char* htvm_encoder_last_error(const htvm_encoder* encoder);

/* Codes one frame; the arrays are only read during the call. pose: for the skeleton of the options; NULL if the tracker
 * lost it (not allowed for the first frame), or if there is no skeleton. Timestamps must ascend. force_intra: 1 for an
 * I-frame. HTVM_BAD_INPUT: the mesh or pose is invalid; HTVM_LIMIT: under rate control, a frame that does not fit the
 * buffer. After an error the frame is not part of the stream, and the next may be sent. With the option tracked.group,
 * frames are held until their group is whole: none or several packets come at once then. With latency_frames a call
 * codes an earlier frame, and an error may belong to that one: it is not part of the stream then. */
htvm_status htvm_encoder_send_mesh(htvm_encoder* encoder, const htvm_mesh* mesh, const htvm_pose* pose,
                                   int64_t timestamp_us, int force_intra);

/* Sets the bits per second that the line carries from the next frame on; the quality follows within half a second.
 * HTVM_BAD_INPUT: the options gave no rate.bits_per_second, or this is none that they could have given. */
htvm_status htvm_encoder_set_bitrate(htvm_encoder* encoder, double bits_per_second);

/* Sets how much is searched for each frame from the next on: 1 to 9, as the option tracked.effort. 0, for a frame that
 * would be late otherwise: its motion alone is coded, unless the picture would fall apart. HTVM_BAD_INPUT: above 9, or
 * another profile than the tracked one. */
htvm_status htvm_encoder_set_effort(htvm_encoder* encoder, uint32_t effort);

/* Sets who decides, for the meshes sent from here on, whether lost tracking is repaired at once, which takes three to
 * ten times as long as other frames. may_repair is called, with user, while a frame is coded and tracking turns out to
 * be lost in it, perhaps from a thread of the encoder's. On 0 the frame is sent as it was tracked, and a later one asks
 * anew. Where the picture would fall apart, 4 mm off all over or 30 mm in a region of 10 cm of an adult, it is not
 * called, and the frame is repaired. NULL: all are repaired. HTVM_BAD_INPUT: another profile than the tracked one. */
typedef int (*htvm_may_repair)(void* user);
htvm_status htvm_encoder_set_repair(htvm_encoder* encoder, htvm_may_repair may_repair, void* user);

/* Ends the sequence: codes what is held. No mesh may be sent afterwards. After an error nothing has ended: the held
 * frame that failed is not part of the stream, and a second call goes on with the others. */
htvm_status htvm_encoder_finish(htvm_encoder* encoder);

/* Copies the next packet, ready to be stored or sent. *size is set to its size in bytes. HTVM_BUFFER_TOO_SMALL if
 * capacity is less; the packet can still be received (so a capacity of 0 asks for the size). HTVM_AGAIN: none until
 * more is sent; HTVM_END: no more. A stream in a file is the sequence of its packets. */
htvm_status htvm_encoder_receive_packet(htvm_encoder* encoder, uint8_t* buffer, size_t capacity, size_t* size);

/* The index that a finished file begins with: its frames, duration, bounds, and where decoding can start. It goes in
 * front of the packets received, the last of which, the index at the end, is then left out. HTVM_BUFFER_TOO_SMALL as
 * above. HTVM_AGAIN before htvm_encoder_receive_packet() has returned HTVM_END; HTVM_END: the stream has no frames. */
htvm_status htvm_encoder_front_index(htvm_encoder* encoder, uint8_t* buffer, size_t capacity, size_t* size);

/* About the last frame whose packet can be received: its type and how many bytes it took. HTVM_AGAIN before any. */
htvm_status htvm_encoder_last_frame(htvm_encoder* encoder, htvm_frame_info* info, size_t info_size);

#ifdef __cplusplus
}
#endif

#endif
