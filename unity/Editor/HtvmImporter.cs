// Makes .htvm files in a project's folders assets: an HtvmStream, and the mesh of its first frame to look at.
using System.IO;
using UnityEditor.AssetImporters;
using UnityEngine;

namespace Htvm
{
    [ScriptedImporter(1, "htvm")]
    public sealed class HtvmImporter : ScriptedImporter
    {
        public override void OnImportAsset(AssetImportContext context)
        {
            var stream = ScriptableObject.CreateInstance<HtvmStream>();
            stream.bytes = File.ReadAllBytes(context.assetPath);
            context.AddObjectToAsset("stream", stream);
            context.SetMainObject(stream);
            try
            {
                using (var film = new FrameFile(stream.bytes))
                {
                    film.Show(0);
                    stream.frames = film.FrameCount;
                    stream.seconds = film.Duration / 1e6f;
                    stream.vertices = film.Frame.VertexCount;
                    string title;
                    film.Decoder.Metadata().TryGetValue("title", out title);
                    stream.title = title ?? "";
                    SequenceInfo sequence;
                    film.Decoder.Sequence(out sequence);
                    var first = new HtvmMesh();
                    first.Show(film.Frame, sequence.Up, true);
                    first.Mesh.name = "first frame";
                    context.AddObjectToAsset("first frame", first.Mesh);
                }
            }
            catch (HtvmException exception)
            {
                context.LogImportError(context.assetPath + ": " + exception.Message);
            }
        }
    }
}
