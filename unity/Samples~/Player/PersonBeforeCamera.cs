// Put this on any object of a scene with a camera and press Play: a person stands two metres before the camera.
using Htvm;
using UnityEngine;

public sealed class PersonBeforeCamera : MonoBehaviour
{
    [Tooltip("The person.htvm beside this script, or any other .htvm asset.")]
    public HtvmStream stream;
    [Tooltip("Or a live stream: http://HUB:8080/watch/NAME")]
    public string address = "";

    void Start()
    {
        var person = new GameObject("person", typeof(MeshFilter), typeof(MeshRenderer));
        person.transform.position = new Vector3(0, -1, 2);
        person.GetComponent<MeshRenderer>().sharedMaterial = new Material(Shader.Find("Htvm/Vertex colours"));
        var player = person.AddComponent<HtvmPlayer>();
        player.stream = stream;
        player.address = address;
    }
}
