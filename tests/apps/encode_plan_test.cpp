// What `htvm encode` refuses before it reads anything, and what it decides where nothing is said.
#include "encode_plan.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "core/thread.h"
#include "picture_pace.h"
#include "rate_passes.h"

namespace htvm::app {
namespace {

EncodeRequest usual() {
    EncodeRequest out;
    out.capture.inputs = {"capture"};
    out.output = "person.htvm";
    return out;
}

EncodeRequest piped() {
    auto out = usual();
    out.capture.inputs = {"-"};
    return out;
}

EncodeRequest to_hub() {
    auto out = usual();
    out.output = "ws://localhost:8080/publish/person";
    return out;
}

EncodeRequest with_pictures(TextureAs use, Profile profile) {
    auto out = usual();
    out.capture.texture_as = use;
    out.encoding.profile = profile;
    return out;
}

void give(EncodeRequest& request, std::string_view name, double value) {
    request.encoding.given.emplace_back(find_option(name), value);
}

void give_bitrate(EncodeRequest& request) { give(request, "rate.bits_per_second", 4e6); }

EncodePlan plan(const EncodeRequest& request) {
    auto out = plan_of(request);
    EXPECT_TRUE(out) << (out ? "" : out.error().message);
    return out ? *out : EncodePlan();
}

// ---- Contradictions -------------------------------------------------------------------------------------------------

TEST(Contradictions, NothingIsWrongWithWhatIsUsual) {
    EXPECT_EQ(contradiction_in(usual()), "");
    EXPECT_EQ(contradiction_in(piped()), "");
    EXPECT_EQ(contradiction_in(to_hub()), "");
    EXPECT_EQ(contradiction_in(with_pictures(TextureAs::picture, Profile::tracked)), "");
    EXPECT_EQ(contradiction_in(with_pictures(TextureAs::captured, Profile::topology)), "");
    EXPECT_EQ(contradiction_in(with_pictures(TextureAs::keep, Profile::paper)), "");
}

TEST(Contradictions, OptionsOfAnotherProfileDoNothing) {
    auto request = usual();
    give(request, "topology.nearest_vertices", 8);
    EXPECT_EQ(contradiction_in(request), "--nearest does nothing with --profile tracked: add --profile topology");
    request = usual();
    request.encoding.profile = Profile::paper;
    give(request, "tracked.simplify", 0);
    EXPECT_EQ(contradiction_in(request), "--simplify does nothing with --profile paper: add --profile tracked");
}

TEST(Contradictions, WhatTheEncoderDoesNotTakeTogetherIsSaidInFlags) {
    auto request = usual();
    give(request, "key_interval", 4);
    give(request, "least_key_interval", 5);
    EXPECT_EQ(contradiction_in(request), "--min-keyint, 5 frames, is above --keyint, 4");
}

TEST(Contradictions, SettingsOfVideoNeedPicturesThatAreCodedAsVideo) {
    const std::string advice =
        ": is for pictures that are coded as video: add --texture-as picture, projection or "
        "captured";
    auto request = usual();
    request.pictures.size = 512;
    EXPECT_EQ(contradiction_in(request), "");      // pictures are what images become
    request.encoding.profile = Profile::topology;  // colours are
    EXPECT_EQ(contradiction_in(request), "--texture-size" + advice);
    request = with_pictures(TextureAs::colours, Profile::tracked);
    request.pictures.size = 512;
    EXPECT_EQ(contradiction_in(request), "--texture-size" + advice);
    request = with_pictures(TextureAs::keep, Profile::topology);
    request.pictures.codec = PictureCoder::av1;
    EXPECT_EQ(contradiction_in(request), "--texture-codec" + advice);
    request = with_pictures(TextureAs::coordinates, Profile::topology);
    request.pictures.quality = 50;
    EXPECT_EQ(contradiction_in(request), "--texture-quality" + advice);
}

TEST(Contradictions, PicturesGoWithTheMeshesThatTheyLieOn) {
    EXPECT_EQ(contradiction_in(with_pictures(TextureAs::captured, Profile::tracked)),
              "--texture-as: captured keeps every frame's own texture coordinates, which --profile tracked does not: "
              "add --profile topology, or give picture");
    EXPECT_EQ(contradiction_in(with_pictures(TextureAs::keep, Profile::tracked)),
              "--texture-as: keep keeps every frame's own texture coordinates, which --profile tracked does not: add "
              "--profile topology, or give picture");
    EXPECT_EQ(contradiction_in(with_pictures(TextureAs::picture, Profile::topology)),
              "--texture-as: picture is drawn on a mesh that lasts, as --profile tracked makes it; with other profiles "
              "give captured");
    auto request = with_pictures(TextureAs::picture, Profile::tracked);
    request.capture.texture.files = "none";
    EXPECT_EQ(contradiction_in(request), "--texture: none leaves no images for --texture-as picture");
}

TEST(Contradictions, ABitrateIsOfThePicturesToo) {
    auto request = with_pictures(TextureAs::keep, Profile::topology);
    give_bitrate(request);
    EXPECT_EQ(contradiction_in(request),
              "--texture-as: keep leaves image files as large as they are, which no --bitrate can change; captured "
              "codes them as video");
    request = with_pictures(TextureAs::picture, Profile::tracked);
    give_bitrate(request);
    EXPECT_EQ(contradiction_in(request), "");
    request.pictures.quality = 50;
    EXPECT_EQ(contradiction_in(request), "--texture-quality: follows from --bitrate; give one of the two");
}

TEST(Contradictions, ACaptureIsCutInOneWay) {
    const std::string why =
        "--chunks: says where the capture is cut, and --jobs and --job cut it by --keyint: give one of them";
    auto request = usual();
    request.chunks = 0;  // one per core
    request.jobs = 2;
    EXPECT_EQ(contradiction_in(request), why);
    request.jobs = 0;
    request.job = {2, 3};
    EXPECT_EQ(contradiction_in(request), why);
}

TEST(Contradictions, GroupsDoNotKnowOfEachOther) {
    const auto cut_by = [](EncodeRequest request) {
        request.jobs = 2;
        return contradiction_in(request);
    };
    EXPECT_EQ(cut_by(usual()), "");
    EXPECT_EQ(cut_by(piped()), "--jobs: takes frames from many places at once, which needs files, not standard input");
    EXPECT_EQ(cut_by(to_hub()), "--jobs: encodes groups of frames at once: for files, not for what is live");
    auto request = usual();
    give_bitrate(request);
    EXPECT_EQ(cut_by(request),
              "--jobs: encodes groups of frames that do not know what the others take, so they cannot share a "
              "--bitrate; -q and --target-error go with it");
    request.jobs = 0;
    request.chunks = 3;
    EXPECT_TRUE(contradiction_in(request).starts_with("--chunks: encodes groups of frames that do not know"));
}

TEST(Contradictions, SoundAndARandomSessionAreOfAllJobs) {
    auto request = usual();
    request.job = {1, 3};
    request.audio.file = "voice.wav";
    EXPECT_EQ(contradiction_in(request), "--audio: is for the whole: give it to the htvm join of the parts");
    request.audio.file.clear();
    request.encoding.draws_session = true;
    EXPECT_EQ(contradiction_in(request),
              "--session: is random, so the parts of several jobs would not be of one stream: give all the same "
              "number");
    request.job = {};
    EXPECT_EQ(contradiction_in(request), "");
}

TEST(Contradictions, AFixedBitrateNeedsARateAndAHub) {
    const std::string why = "--fixed-bitrate: does nothing without a --bitrate and a hub to publish to";
    auto request = to_hub();
    request.publishing.fixed_bitrate = true;
    EXPECT_EQ(contradiction_in(request), why);
    give_bitrate(request);
    EXPECT_EQ(contradiction_in(request), "");
    request.output = "person.htvm";
    EXPECT_EQ(contradiction_in(request), why);
}

TEST(Contradictions, StandardOutputHoldsOneThing) {
    auto request = usual();
    request.json = true;
    EXPECT_EQ(contradiction_in(request), "");
    request.output = "-";
    EXPECT_EQ(contradiction_in(request), "--json: prints on standard output, where -o - puts the stream; choose one");
}

TEST(Contradictions, FilesCanWait) {
    auto request = usual();
    request.drop_late = true;
    EXPECT_EQ(contradiction_in(request), "--drop-late: is for meshes on standard input: files can wait");
    request.capture.inputs = {"-"};
    EXPECT_EQ(contradiction_in(request), "");
}

TEST(Contradictions, TheClockGoesFrameByFrame) {
    const auto each = [](const auto& change, const std::string& why) {
        auto request = usual();
        request.deadline = 33;
        change(request);
        EXPECT_EQ(contradiction_in(request), "--deadline: " + why);
        request.deadline = 0;
        request.effort_log = "efforts.csv";
        EXPECT_EQ(contradiction_in(request), "--effort-log: " + why);
        request.effort_log.clear();
        request.repeat_efforts = "efforts.csv";
        EXPECT_EQ(contradiction_in(request), "--repeat-efforts: " + why);
        request.repeat_efforts.clear();
        EXPECT_EQ(contradiction_in(request), "");
    };
    each([](EncodeRequest& r) { r.encoding.profile = Profile::topology; },
         "is for --profile tracked: the others have no efforts");
    each([](EncodeRequest& r) { r.chunks = 4; }, "goes frame by frame through the capture, not with --chunks");
    each([](EncodeRequest& r) { r.jobs = 4; }, "goes frame by frame through the capture, not with --jobs");
    each([](EncodeRequest& r) { r.job = {1, 4}; }, "goes frame by frame through the capture, not with --job");
    each([](EncodeRequest& r) { r.encoding.passes = 2; }, "goes with one pass over the frames, not with --passes 2");
}

TEST(Contradictions, TheLogIsNotWrittenOverTheStream) {
    const std::string why = " is where -o puts the stream: give the log another name";
    auto request = usual();
    for (const std::string log : {"person.htvm", "./person.htvm", "person.htvm.partial"}) {
        request.effort_log = log;
        EXPECT_EQ(contradiction_in(request), "--effort-log: " + log + why);
    }
    request.output = "efforts.csv.partial";
    request.effort_log = "efforts.csv";
    EXPECT_EQ(contradiction_in(request), "--effort-log: efforts.csv" + why);
    request.output = "person.htvm";
    EXPECT_EQ(contradiction_in(request), "");
}

TEST(Contradictions, NobodyWaitsForFramesThatAreHeldBack) {
    auto request = to_hub();
    give(request, "tracked.group", 4);
    EXPECT_EQ(contradiction_in(request),
              "--group: holds frames back, which who watches live would wait for: it is for files, not for a hub");
    request = usual();
    request.deadline = 50;
    give(request, "tracked.group", 4);
    EXPECT_EQ(contradiction_in(request), "--group: holds frames back, beyond any --deadline: give one of the two");
    request = usual();
    request.deadline = 50;
    give(request, "latency_frames", 1);
    EXPECT_EQ(contradiction_in(request),
              "--latency-frames: lets a frame wait for the next one, while --deadline counts the time until it is "
              "coded: give one of them");
    request = usual();
    request.deadline = std::nan("");
    EXPECT_EQ(contradiction_in(request), "--deadline: is a number of milliseconds, not nan");
}

TEST(Contradictions, StandardInputComesOnce) {
    auto request = piped();
    give_bitrate(request);
    request.encoding.passes = 2;
    EXPECT_EQ(contradiction_in(request),
              "--passes: 2 reads the capture twice, which standard input does not allow; give files, or --passes 1");
    request.encoding.passes = 1;
    EXPECT_EQ(contradiction_in(request), "");
}

TEST(Contradictions, NoPlanIsMadeOfOne) {
    auto request = usual();
    request.drop_late = true;
    const auto plan = plan_of(request);
    ASSERT_FALSE(plan);
    EXPECT_EQ(plan.error().kind, ErrorKind::bad_input);
    EXPECT_EQ(plan.error().message, contradiction_in(request));
}

// ---- Decisions ------------------------------------------------------------------------------------------------------

TEST(EncodePlan, FramesOfAFileMayWaitAndOthersMayNot) {
    EXPECT_EQ(plan(usual()).encoder.latency_frames, 1);
    EXPECT_EQ(plan(piped()).encoder.latency_frames, 0);
    EXPECT_EQ(plan(to_hub()).encoder.latency_frames, 0);
    auto request = usual();
    request.deadline = 50;
    EXPECT_EQ(plan(request).encoder.latency_frames, 0);
    request = usual();
    request.effort_log = "efforts.csv";
    EXPECT_EQ(plan(request).encoder.latency_frames, 0);
    request = usual();
    give(request, "latency_frames", 2);
    EXPECT_EQ(plan(request).encoder.latency_frames, 2);
}

TEST(EncodePlan, GroupsOfFramesAreForFilesAlone) {
    EXPECT_EQ(plan(usual()).encoder.tracked.group, 8);
    EXPECT_EQ(plan(to_hub()).encoder.tracked.group, 1);
    EXPECT_EQ(plan(piped()).encoder.tracked.group, 0) << "by the effort";
    auto request = usual();
    request.repeat_efforts = "efforts.csv";
    EXPECT_EQ(plan(request).encoder.tracked.group, 1);
    request = usual();
    request.output = "-";
    EXPECT_EQ(plan(request).encoder.tracked.group, 8) << "the same stream as in a file";
}

TEST(EncodePlan, PicturesOfFilesAreCodedByThoseThatFollowThemTheSlowerTheMoreEffort) {
    for (const auto& [effort, speed] :
         {std::pair(1, 9), std::pair(2, 9), std::pair(3, 8), std::pair(5, 8), std::pair(6, 7), std::pair(9, 7)}) {
        auto request = usual();
        give(request, "tracked.effort", effort);
        EXPECT_EQ(plan(request).speed_ahead, speed) << effort;
    }
    EXPECT_TRUE(plan(piped()).speed_ahead);
    EXPECT_FALSE(plan(to_hub()).speed_ahead);
    auto to_pipe = usual(), paced = piped();
    to_pipe.output = "-";
    EXPECT_FALSE(plan(to_pipe).speed_ahead);
    paced.deadline = 50;
    EXPECT_FALSE(plan(paced).speed_ahead);
}

TEST(EncodePlan, FilesAreInGroupsWhereTheyMayBeAndTimeIsNotWorthMoreThanBits) {
    const auto group_with = [](const char* option, double value) {
        auto request = usual();
        give(request, option, value);
        return plan(request).encoder.tracked.group;
    };
    EXPECT_EQ(group_with("tracked.effort", 3), 8);
    EXPECT_EQ(group_with("tracked.effort", 2), 0);
    EXPECT_EQ(group_with("tracked.group", 1), 1);
    EXPECT_EQ(group_with("tracked.group", 4), 4);
    EXPECT_EQ(group_with("rate.bits_per_second", 1e6), 0);
    EXPECT_EQ(group_with("rate.target_error", 0.5), 0);
    EXPECT_EQ(group_with("key_interval", 1), 0);
    auto by_bones = usual();
    by_bones.encoding.profile = Profile::topology;
    EXPECT_EQ(plan(by_bones).encoder.tracked.group, 0);
}

TEST(EncodePlan, WhatMayBeLiveHasASessionOfItsOwn) {
    EXPECT_EQ(plan(usual()).encoder.session, 0u);
    EXPECT_NE(plan(to_hub()).encoder.session, 0u);
    EXPECT_NE(plan(to_hub()).encoder.session, plan(to_hub()).encoder.session);
    auto request = usual();
    request.output = "-";
    EXPECT_NE(plan(request).encoder.session, 0u);
    request.job = {1, 2};  // whose other part must have the same
    EXPECT_EQ(plan(request).encoder.session, 0u);
    request = to_hub();
    give(request, "session", 5);
    EXPECT_EQ(plan(request).encoder.session, 5u);
}

TEST(EncodePlan, ADestinationIsKnownByItsName) {
    EXPECT_EQ(plan(usual()).output.kind, DestinationKind::file);
    EXPECT_EQ(plan(to_hub()).output.kind, DestinationKind::hub);
    EXPECT_EQ(destination_of("wss://hub.example/publish/person").kind, DestinationKind::hub);
    EXPECT_EQ(destination_of("-").kind, DestinationKind::standard_output);
    EXPECT_EQ(destination_of("/dev/null").kind, DestinationKind::pipe);
    const auto file = std::filesystem::temp_directory_path() / "htvm_encode_plan_test.htvm";
    std::ofstream(file) << "an earlier stream";
    EXPECT_EQ(destination_of(file.string()).kind, DestinationKind::file);
    std::filesystem::remove(file);
}

TEST(EncodePlan, ABitrateIsMetInAsManyPassesAsItTakes) {
    const auto passes = [](EncodeRequest request) {
        give_bitrate(request);
        const auto made = plan(request);
        return std::pair(made.fewest_passes, made.most_passes);
    };
    EXPECT_EQ(plan(usual()).most_passes, 1);
    EXPECT_EQ(passes(usual()), std::pair(2, most_passes));
    EXPECT_EQ(passes(piped()), std::pair(1, 1));
    EXPECT_EQ(passes(to_hub()), std::pair(2, 2));  // what was sent cannot be taken back
    auto request = usual();
    request.encoding.passes = 1;
    EXPECT_EQ(passes(request), std::pair(1, 1));
    request.encoding.passes = 2;
    EXPECT_EQ(passes(request), std::pair(2, 2));
    request = usual();
    request.deadline = 50;
    EXPECT_EQ(passes(request), std::pair(1, 1));
}

TEST(EncodePlan, PicturesAreStartedAtEveryThreeSecondsUnlessTold) {
    auto request = usual();
    EXPECT_EQ(plan(request).access_interval_with_pictures, 90);
    EXPECT_EQ(plan(request).encoder.tracked.access_interval, EncoderOptions().tracked.access_interval);
    give(request, "tracked.access_interval", 45);
    EXPECT_EQ(plan(request).access_interval_with_pictures, 45);
}

TEST(EncodePlan, ImagesBecomePicturesByDefault) {
    EXPECT_EQ(plan(usual()).capture.of_images, TextureAs::picture);
    EXPECT_EQ(plan(piped()).capture.of_images, TextureAs::picture);
    auto request = usual();
    request.chunks = 2;
    EXPECT_EQ(plan(request).capture.of_images, TextureAs::picture);
    request = usual();
    request.encoding.profile = Profile::topology;
    EXPECT_EQ(plan(request).capture.of_images, TextureAs::colours);
    EXPECT_EQ(plan(request).capture.texture_as, TextureAs::by_default);  // until there is an image
}

TEST(EncodePlan, ImagesBecomePicturesInJobsToo) {
    auto request = usual();
    request.jobs = 2;
    EXPECT_EQ(plan(request).capture.of_images, TextureAs::picture);
    request.jobs = 0;
    request.job = {1, 2};
    EXPECT_EQ(plan(request).capture.of_images, TextureAs::picture);
    EXPECT_FALSE(plan(request).capture.pictures_too_slow) << "nobody waits";
}

TEST(EncodePlan, ImagesBecomePicturesWhereFramesAreWaitedForIfTheseAreFastEnough) {
    auto request = to_hub();
    EXPECT_EQ(plan(request).capture.of_images, TextureAs::picture);
    EXPECT_TRUE(plan(request).capture.pictures_too_slow);
    request = piped();
    EXPECT_FALSE(plan(request).capture.pictures_too_slow);
    request.deadline = 50;
    EXPECT_TRUE(plan(request).capture.pictures_too_slow);
}

TEST(PicturePace, PicturesMayTakeHalfOfAFrame) {
    EXPECT_EQ(too_slow(20, 40), "");
    EXPECT_EQ(too_slow(20.4, 40),
              "drawing and coding a picture took 20 ms when it was tried, and frames that come every 40 ms leave 20 ms "
              "for it; --texture-as picture sends pictures all the same");
}

TEST(PicturePace, IsTriedWithTheFirstMeshAndAllQualitiesAndNotWithoutAnImage) {
    TexturedMesh square;
    square.mesh.positions = {{0, 0, 0}, {1000, 0, 0}, {1000, 1000, 0}, {0, 1000, 0}};
    square.mesh.texcoords = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    square.mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    const auto slow = pictures_too_slow({{}, {42}, 1, 0});
    EXPECT_EQ(slow(square, TextureAs::picture, 1e-6), "") << "there is no image";
    square.texture = std::make_shared<const Image>(Image{64, 64, std::vector<std::uint8_t>(3 * 64 * 64, 100)});
    EXPECT_EQ(slow(square, TextureAs::picture, 1e9), "");
    EXPECT_NE(slow(square, TextureAs::picture, 1e-6), "");
    EXPECT_NE(slow(square, TextureAs::projection, 1e-6), "");
    EXPECT_NE(pictures_too_slow({{}, {42}, 1, 1e-6})(square, TextureAs::picture, 1e9), "") << "the deadline";
    EXPECT_EQ(pictures_too_slow({{}, {}, 1, 0})(square, TextureAs::picture, 1e-6), "") << "of no rung";
}

TEST(EncodePlan, ImagesBecomeColoursInOtherProfilesAndItIsSaidWhy) {
    auto request = usual();
    request.encoding.profile = Profile::paper;
    EXPECT_EQ(plan(request).capture.of_images, TextureAs::colours);
    EXPECT_EQ(plan(request).capture.why_no_pictures.substr(0, 23), "--texture-as captured s");
}

TEST(EncodePlan, APresetIsAPlaceOnTheOneScaleOfQuality) {
    auto request = usual();
    for (const auto& [preset, quality] :
         {std::pair(Preset::web, default_quality), std::pair(Preset::studio, 65.0), std::pair(Preset::master, 85.0)}) {
        request.encoding.preset = preset;
        EXPECT_EQ(plan(request).encoder.quality, quality);
    }
}

TEST(EncodePlan, PicturesGetFinerAndLargerWithTheQuality) {
    EXPECT_EQ(picture_side_of(1088, default_quality), 1088);
    EXPECT_EQ(picture_side_of(1024, 100), 2048);
    EXPECT_EQ(picture_side_of(4096, 100), 4096);  // the most there is
    int side = 0, quantiser = 64, ahead = 64;
    for (double quality = 20; quality <= 100; quality += 10) {
        EXPECT_GT(picture_side_of(1024, quality), side);
        EXPECT_LT(quantiser_of(PictureCoder::av1, quality), quantiser);
        EXPECT_LT(quantiser_of(PictureCoder::av1, quality, /*foresees=*/true), ahead);
        side = picture_side_of(1024, quality);
        quantiser = quantiser_of(PictureCoder::av1, quality);
        ahead = quantiser_of(PictureCoder::av1, quality, /*foresees=*/true);
        EXPECT_EQ(side % 64, 0);
    }
}

TEST(EncodePlan, ACameraIsReadAtItsPace) {
    EXPECT_EQ(plan(piped()).capture.while_busy, WhileBusy::wait);
    auto request = piped();
    request.deadline = 50;
    EXPECT_EQ(plan(request).capture.while_busy, WhileBusy::read_on);
    request.drop_late = true;
    EXPECT_EQ(plan(request).capture.while_busy, WhileBusy::drop);
}

TEST(EncodePlan, LatencyIsCountedWhereItMatters) {
    EXPECT_FALSE(plan(usual()).is_timed);
    EXPECT_TRUE(plan(piped()).is_timed);
    auto request = usual();
    request.deadline = 50;
    EXPECT_TRUE(plan(request).is_timed);
    request = piped();
    request.encoding.profile = Profile::topology;
    EXPECT_FALSE(plan(request).is_timed);
}

TEST(EncodePlan, ChunksAreAsManyAsCoresWhereNoneAreCounted) {
    auto request = usual();
    request.chunks = 0;
    EXPECT_EQ(plan(request).chunks, internal::thread_count(0));
    EXPECT_FALSE(plan(usual()).in_groups());
}

TEST(EncodePlan, TheFloorIsANumberOrTheLowestVertex) {
    auto request = usual();
    EXPECT_FALSE(plan(request).floor.is_lowest);
    EXPECT_FALSE(plan(request).floor.metres);
    request.encoding.floor = "lowest";
    EXPECT_TRUE(plan(request).floor.is_lowest);
    request.encoding.floor = "-0.25";
    EXPECT_EQ(plan(request).floor.metres, -0.25);
    for (const std::string odd : {"low", "nan", "inf", "1 m"}) {
        request.encoding.floor = odd;
        const auto made = plan_of(request);
        ASSERT_FALSE(made);
        EXPECT_EQ(made.error().message, "--floor must be a number of metres or lowest, not '" + odd + "'");
    }
}

TEST(EncodePlan, WhatWasGivenIsInTheEncodersOptions) {
    auto request = usual();
    request.encoding.profile = Profile::topology;
    request.encoding.quality = 50;
    request.encoding.metadata = {{"title", "A walk"}};
    request.encoding.intra = IntraCoder::draco;
    give(request, "key_interval", 7);
    give(request, "colour_step", 3);
    const auto made = plan(request);
    EXPECT_EQ(made.encoder.profile, Profile::topology);
    EXPECT_EQ(made.encoder.key_interval, 7);
    EXPECT_EQ(made.encoder.quality, 50);
    EXPECT_EQ(made.encoder.geometry_step, 0);  // by the quality
    EXPECT_EQ(made.encoder.colour_step, 3);
    EXPECT_EQ(made.encoder.metadata, request.encoding.metadata);
    ASSERT_TRUE(made.encoder.intra_coder);
    EXPECT_STREQ(made.encoder.intra_coder->name, draco_intra_coder().name);
}

}  // namespace
}  // namespace htvm::app
