// Plays a stream in Unity: put this and csharp/Htvm.cs into Assets, libhtvm_c into Assets/Plugins, person.htvm into
// Assets/StreamingAssets, and this component on an object with a MeshFilter and a MeshRenderer whose shader shows vertex
// colours. Frames are decoded when they are due, at their own times; the stream starts again at its end.
using System;
using System.IO;
using Htvm;
using UnityEngine;
using UnityEngine.Rendering;

[RequireComponent(typeof(MeshFilter), typeof(MeshRenderer))]
public class HtvmPlayer : MonoBehaviour
{
    public string file = "person.htvm";

    FrameReader frames;
    Mesh mesh;
    double seconds;   // since the first frame
    long firstUs;
    bool due;         // the reader's frame is one that is not shown yet
    Vector3[] vertices = new Vector3[0];
    Color32[] colours = new Color32[0];
    int[] indices = new int[0];

    void Start()
    {
        mesh = new Mesh { indexFormat = IndexFormat.UInt32 };
        mesh.MarkDynamic();
        GetComponent<MeshFilter>().mesh = mesh;
        Open();
    }

    void Open()
    {
        if (frames != null) frames.Dispose();
        frames = new FrameReader(File.OpenRead(Path.Combine(Application.streamingAssetsPath, file)));
        seconds = 0;
        due = Advance();
        if (due) firstUs = frames.Info.TimestampUs;
    }

    void Update()
    {
        // Late frames are decoded, since later ones need them, and only the last of them is shown.
        bool shown = false;
        while (due && (frames.Info.TimestampUs - firstUs) / 1e6 <= seconds)
        {
            Take(frames);
            shown = true;
            due = Advance();
        }
        if (shown) Show();
        seconds += Time.deltaTime;
        if (!due) Open();
    }

    bool Advance()
    {
        for (;;)
        {
            try
            {
                return frames.Next();
            }
            catch (HtvmException exception)
            {
                Debug.LogWarning(exception.Message); // it costs one packet
            }
        }
    }

    // Unity's space is left-handed and in metres: x is mirrored, and triangles turn the other way.
    void Take(FrameReader frame)
    {
        if (vertices.Length != frame.VertexCount)
        {
            vertices = new Vector3[frame.VertexCount];
            colours = new Color32[frame.VertexCount];
        }
        float[] p = frame.Positions;
        for (int v = 0; v < vertices.Length; ++v)
            vertices[v] = new Vector3(-0.001f * p[3 * v], 0.001f * p[3 * v + 1], 0.001f * p[3 * v + 2]);
        bool coloured = frame.Has(Attributes.Colours);
        byte[] c = frame.Colours;
        for (int v = 0; v < colours.Length; ++v)
            colours[v] = coloured ? new Color32(c[3 * v], c[3 * v + 1], c[3 * v + 2], 255) : new Color32(255, 255, 255, 255);
        if (!frame.TopologyChanged) return;
        indices = new int[frame.IndexCount];
        for (int i = 0; i < indices.Length; i += 3)
        {
            indices[i] = frame.Indices[i];
            indices[i + 1] = frame.Indices[i + 2];
            indices[i + 2] = frame.Indices[i + 1];
        }
        mesh.Clear(); // its triangles are those of other vertices
    }

    void Show()
    {
        mesh.SetVertices(vertices);
        mesh.SetColors(colours);
        mesh.SetIndices(indices, MeshTopology.Triangles, 0);
        mesh.RecalculateNormals();
    }

    void OnDestroy()
    {
        if (frames != null) frames.Dispose();
    }
}
